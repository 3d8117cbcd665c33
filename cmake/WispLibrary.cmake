# Helpers that give every wisp library the same rules: C++20, warnings, hidden
# symbols, an include root of its own, and an export set of its own.

include_guard(GLOBAL)
include(WispPkgConfig)

# The version stands in two headers, since hair goes without core.
foreach(header core/include/wisp/core/version.h hair/include/wisp/hair/version.h)
  file(STRINGS ${PROJECT_SOURCE_DIR}/libs/${header} lines
    REGEX "^#define WISP_VERSION_[A-Z]+ [0-9\"]")
  string(REPLACE "." ";" parts ${PROJECT_VERSION})
  list(TRANSFORM parts PREPEND " ")
  string(REGEX REPLACE "#define WISP_VERSION_[A-Z]+" "" lines "${lines}")
  if(NOT lines STREQUAL "${parts}; \"${PROJECT_VERSION}\"")
    message(FATAL_ERROR "libs/${header} does not say version ${PROJECT_VERSION}: ${lines}")
  endif()
endforeach()

# Shared libraries find each other, and the command finds them, wherever the whole is
# moved to.
if(BUILD_SHARED_LIBS AND PROJECT_IS_TOP_LEVEL AND NOT DEFINED CMAKE_INSTALL_RPATH AND
    NOT IS_ABSOLUTE "${CMAKE_INSTALL_LIBDIR}" AND NOT IS_ABSOLUTE "${CMAKE_INSTALL_BINDIR}")
  file(RELATIVE_PATH wisp_libs_from_bin /p/${CMAKE_INSTALL_BINDIR} /p/${CMAKE_INSTALL_LIBDIR})
  set(CMAKE_INSTALL_RPATH "$ORIGIN" "$ORIGIN/${wisp_libs_from_bin}")
endif()

# A project around this one may ask for fast math, which breaks exact predicates, bounds
# that are rounded outwards and what is done for NaN.
set(wisp_strict_math "")
if(NOT PROJECT_IS_TOP_LEVEL OR CMAKE_CXX_FLAGS MATCHES "-Ofast|-f[a-z-]*-math")
  set(wisp_strict_math -fno-fast-math)
endif()

# Warnings and sanitizers, for targets of this project only.
add_library(wisp_build_flags INTERFACE)
target_compile_options(wisp_build_flags INTERFACE
  -Wall -Wextra -Wconversion
  ${wisp_strict_math}
  # The results must not depend on whether the machine has fused multiply-add.
  -ffp-contract=off
  $<$<BOOL:${WISP_WERROR}>:-Werror>
  $<$<BOOL:${WISP_SANITIZE}>:-fsanitize=address,undefined -fno-sanitize-recover=undefined -fno-omit-frame-pointer>)
target_link_options(wisp_build_flags INTERFACE
  $<$<BOOL:${WISP_SANITIZE}>:-fsanitize=address,undefined>)

set(WISP_COMPONENTS "" CACHE INTERNAL "components of this build, in order of dependency")

# wisp_add_library(NAME
#   [HEADERS h...] [SOURCES cpp...]
#   [PUBLIC targets...] [PRIVATE targets...]
#   [FIND_DEPENDENCIES package...] [STATIC_DEPENDENCIES package...]
#   DESCRIPTION text)
# Defines wisp_NAME and wisp::NAME. Without SOURCES it is an interface library.
# FIND_DEPENDENCIES are the packages that a consumer of the installed component
# needs, STATIC_DEPENDENCIES those that are inside, which it needs to link a static one.
function(wisp_add_library name)
  cmake_parse_arguments(arg "" "DESCRIPTION"
    "HEADERS;SOURCES;PUBLIC;PRIVATE;FIND_DEPENDENCIES;STATIC_DEPENDENCIES" ${ARGN})
  set(target wisp_${name})
  if(arg_SOURCES)
    add_library(${target} ${arg_SOURCES})
    set(scope PUBLIC)
    target_link_libraries(${target} PRIVATE $<BUILD_INTERFACE:wisp_build_flags> ${arg_PRIVATE})
    set_target_properties(${target} PROPERTIES
      CXX_VISIBILITY_PRESET hidden VISIBILITY_INLINES_HIDDEN ON
      POSITION_INDEPENDENT_CODE ON
      VERSION ${PROJECT_VERSION} SOVERSION ${PROJECT_VERSION_MAJOR}.${PROJECT_VERSION_MINOR})
    if(NOT BUILD_SHARED_LIBS)
      target_compile_definitions(${target} PUBLIC WISP_STATIC)
    else()
      target_compile_definitions(${target} PRIVATE WISP_BUILDING)
      if(UNIX AND NOT APPLE)
        set(map ${PROJECT_SOURCE_DIR}/cmake/wisp_symbols.map)
        target_link_options(${target} PRIVATE LINKER:--version-script,${map})
        set_target_properties(${target} PROPERTIES LINK_DEPENDS ${map})
      endif()
    endif()
  else()
    add_library(${target} INTERFACE)
    set(scope INTERFACE)
  endif()
  add_library(wisp::${name} ALIAS ${target})
  set_target_properties(${target} PROPERTIES EXPORT_NAME ${name} OUTPUT_NAME wisp_${name})
  target_compile_features(${target} ${scope} cxx_std_20)
  target_link_libraries(${target} ${scope} ${arg_PUBLIC})
  target_sources(${target} ${scope}
    FILE_SET HEADERS BASE_DIRS include FILES ${arg_HEADERS})
  set_target_properties(${target} PROPERTIES VERIFY_INTERFACE_HEADER_SETS ${PROJECT_IS_TOP_LEVEL})

  if(WISP_INSTALL)
    install(TARGETS ${target} EXPORT wisp_${name}_targets
      LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR}
      ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR}
      FILE_SET HEADERS DESTINATION ${CMAKE_INSTALL_INCLUDEDIR})
    install(EXPORT wisp_${name}_targets NAMESPACE wisp::
      FILE wisp_${name}_targets.cmake
      DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/wisp)

    set(compiled "")
    if(arg_SOURCES)
      set(compiled COMPILED)
    endif()
    wisp_install_pkg_config(${name} ${compiled} DESCRIPTION "${arg_DESCRIPTION}"
      PUBLIC ${arg_PUBLIC} PRIVATE ${arg_PRIVATE})
  endif()

  set_property(GLOBAL APPEND PROPERTY WISP_COMPONENTS ${name})
  set(packages ${arg_FIND_DEPENDENCIES})
  if(NOT BUILD_SHARED_LIBS)
    list(APPEND packages ${arg_STATIC_DEPENDENCIES})
  endif()
  list(REMOVE_DUPLICATES packages)
  set_property(GLOBAL PROPERTY WISP_${name}_FIND_DEPENDENCIES "${packages}")
  set(uses ${arg_PUBLIC})
  list(FILTER uses INCLUDE REGEX "^wisp::")
  list(TRANSFORM uses REPLACE "^wisp::" "")
  set_property(GLOBAL PROPERTY WISP_${name}_USES "${uses}")
endfunction()

# Writes and installs wispConfig.cmake, which knows for each component what it
# needs and asks for nothing else.
function(wisp_install_package)
  include(CMakePackageConfigHelpers)
  get_property(components GLOBAL PROPERTY WISP_COMPONENTS)
  set(WISP_CONFIG_COMPONENTS "")
  foreach(name ${components})
    get_property(deps GLOBAL PROPERTY WISP_${name}_FIND_DEPENDENCIES)
    get_property(uses GLOBAL PROPERTY WISP_${name}_USES)
    string(APPEND WISP_CONFIG_COMPONENTS
      "set(_wisp_${name}_uses \"${uses}\")\nset(_wisp_${name}_packages \"${deps}\")\n")
  endforeach()
  string(APPEND WISP_CONFIG_COMPONENTS "set(_wisp_all_components \"${components}\")")
  configure_package_config_file(cmake/wispConfig.cmake.in
    ${CMAKE_CURRENT_BINARY_DIR}/wispConfig.cmake
    INSTALL_DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/wisp)
  write_basic_package_version_file(${CMAKE_CURRENT_BINARY_DIR}/wispConfigVersion.cmake
    COMPATIBILITY SameMinorVersion)
  install(FILES
    ${CMAKE_CURRENT_BINARY_DIR}/wispConfig.cmake
    ${CMAKE_CURRENT_BINARY_DIR}/wispConfigVersion.cmake
    DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/wisp)
endfunction()
