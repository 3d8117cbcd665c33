# A pkg-config file for each component: wisp-hair, wisp-pde and so on.
#
# A build installs its libraries either as static or as shared ones. A static one is
# linked with all that it needs, so that this stands in Requires and Libs and
# `pkg-config --libs` is right as it is, without --static. A shared one knows itself what
# it needs, and asks the user's machine for the headers of the public packages alone.

include_guard(GLOBAL)
find_package(PkgConfig QUIET)

# What the targets of other packages are called by pkg-config.
set(wisp_pc_names
  glm::glm=glm TBB::tbb=tbb hwy::hwy=libhwy fmt::fmt=fmt muparser::muparser=muparser
  OpenEXR::OpenEXR=OpenEXR TinyGLTF::TinyGLTF=tinygltf)

# Appends what a library or target of another package is to pkg-config: to the list
# `requires` where it has a file of its own, else to `libs` and `cflags`.
function(wisp_pc_external item out_requires out_libs out_cflags)
  foreach(pair ${wisp_pc_names})
    if(pair MATCHES "^${item}=(.*)$" AND PKG_CONFIG_EXECUTABLE)
      set(module ${CMAKE_MATCH_1})
      execute_process(COMMAND ${PKG_CONFIG_EXECUTABLE} --exists ${module} RESULT_VARIABLE missing)
      if(missing EQUAL 0)
        set(${out_requires} ${${out_requires}} ${module} PARENT_SCOPE)
        return()
      endif()
    endif()
  endforeach()
  if(NOT TARGET ${item})
    set(${out_libs} ${${out_libs}} -l${item} PARENT_SCOPE)
    return()
  endif()
  get_target_property(folders ${item} INTERFACE_INCLUDE_DIRECTORIES)
  foreach(folder ${folders})
    if(IS_ABSOLUTE "${folder}" AND NOT folder IN_LIST CMAKE_CXX_IMPLICIT_INCLUDE_DIRECTORIES)
      list(APPEND ${out_cflags} "-I\"${folder}\"")
    endif()
  endforeach()
  get_target_property(type ${item} TYPE)
  get_target_property(imported ${item} IMPORTED)
  if(imported AND NOT type STREQUAL INTERFACE_LIBRARY)
    get_target_property(file ${item} LOCATION)
    get_filename_component(folder "${file}" DIRECTORY)
    if(folder IN_LIST CMAKE_CXX_IMPLICIT_LINK_DIRECTORIES AND
        file MATCHES "/lib([^/]+)\\.(so|a|dylib)[^/]*$")
      set(file -l${CMAKE_MATCH_1})
    else()
      set(file "\"${file}\"")
    endif()
    if(file IN_LIST ${out_libs})
      return()
    endif()
    list(APPEND ${out_libs} ${file})
  endif()
  get_target_property(uses ${item} INTERFACE_LINK_LIBRARIES)
  foreach(use ${uses})
    if(TARGET ${use})
      wisp_pc_external(${use} ${out_requires} ${out_libs} ${out_cflags})
    endif()
  endforeach()
  foreach(out ${out_requires} ${out_libs} ${out_cflags})
    set(${out} ${${out}} PARENT_SCOPE)
  endforeach()
endfunction()

# wisp_install_pkg_config(NAME DESCRIPTION text [COMPILED] [PUBLIC targets...] [PRIVATE targets...])
function(wisp_install_pkg_config name)
  cmake_parse_arguments(arg "COMPILED" "DESCRIPTION" "PUBLIC;PRIVATE" ${ARGN})
  set(requires "")
  set(libs "")
  set(inside "")
  set(cflags "-I\${includedir}" -std=c++20)
  if(arg_COMPILED)
    list(APPEND libs "-L\${libdir}" -lwisp_${name})
    if(NOT BUILD_SHARED_LIBS)
      list(APPEND cflags -DWISP_STATIC)
      set(inside ${arg_PRIVATE})
    endif()
  endif()
  foreach(item ${arg_PUBLIC})
    if(item MATCHES "^wisp::(.*)$")
      list(APPEND requires "wisp-${CMAKE_MATCH_1} = ${PROJECT_VERSION}")
    else()
      wisp_pc_external(${item} requires libs cflags)
    endif()
  endforeach()
  set(unused "")  # headers of what is inside are needed no more
  foreach(item ${inside})
    wisp_pc_external(${item} requires libs unused)
  endforeach()
  list(JOIN requires ", " requires)
  list(JOIN libs " " libs)
  list(JOIN cflags " " cflags)

  # The prefix is found from where the file lies, so that the whole may be moved.
  set(pc_folder ${CMAKE_INSTALL_LIBDIR}/pkgconfig)
  if(IS_ABSOLUTE "${CMAKE_INSTALL_LIBDIR}" OR IS_ABSOLUTE "${CMAKE_INSTALL_INCLUDEDIR}")
    set(prefix ${CMAKE_INSTALL_PREFIX})
    set(libdir ${CMAKE_INSTALL_FULL_LIBDIR})
    set(includedir ${CMAKE_INSTALL_FULL_INCLUDEDIR})
  else()
    file(RELATIVE_PATH up /p/${pc_folder} /p)
    string(REGEX REPLACE "/$" "" up "${up}")
    set(prefix "\${pcfiledir}/${up}")
    set(libdir "\${prefix}/${CMAKE_INSTALL_LIBDIR}")
    set(includedir "\${prefix}/${CMAKE_INSTALL_INCLUDEDIR}")
  endif()
  file(WRITE ${CMAKE_CURRENT_BINARY_DIR}/wisp-${name}.pc "\
prefix=${prefix}
libdir=${libdir}
includedir=${includedir}

Name: wisp-${name}
Description: ${arg_DESCRIPTION}
Version: ${PROJECT_VERSION}
Requires: ${requires}
Libs: ${libs}
Cflags: ${cflags}
")
  install(FILES ${CMAKE_CURRENT_BINARY_DIR}/wisp-${name}.pc DESTINATION ${pc_folder})
endfunction()
