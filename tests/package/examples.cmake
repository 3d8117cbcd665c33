# The programs of docs/embedding.md: built from the installed package, all at once, and
# run; and the document, which must show what their files say.

# Without the render component Embree counts as not there, and neither is what needs it.
set(examples_without)
if(NOT TARGET wisp_render)
  set(examples_without ${no_render})
endif()
set(examples_flags "${consumer_flags} -Wall -Wextra -Wconversion")
if(WISP_WERROR)
  string(APPEND examples_flags " -Werror")
endif()

add_test(NAME "package: examples" COMMAND ${CMAKE_CTEST_COMMAND}
  --build-and-test ${PROJECT_SOURCE_DIR}/examples ${CMAKE_CURRENT_BINARY_DIR}/examples
  --build-generator ${CMAKE_GENERATOR}
  --build-makeprogram ${CMAKE_MAKE_PROGRAM}
  --build-options
    -DCMAKE_BUILD_TYPE=$<CONFIG>
    -DCMAKE_CXX_COMPILER=${CMAKE_CXX_COMPILER}
    -DCMAKE_CXX_COMPILER_LAUNCHER=${CMAKE_CXX_COMPILER_LAUNCHER}
    -DCMAKE_CXX_FLAGS=${examples_flags}
    -DCMAKE_FIND_PACKAGE_NO_PACKAGE_REGISTRY=ON
    -Dwisp_ROOT=${prefix}
    ${examples_without}
  --test-command ${CMAKE_CTEST_COMMAND} --output-on-failure --no-tests=error)
set_tests_properties("package: examples" PROPERTIES
  FIXTURES_REQUIRED wisp_package TIMEOUT 900)

add_test(NAME "package: excerpts" COMMAND ${CMAKE_COMMAND}
  -DDOCUMENT=${PROJECT_SOURCE_DIR}/docs/embedding.md -DROOT=${PROJECT_SOURCE_DIR}
  -P ${CMAKE_CURRENT_SOURCE_DIR}/check_excerpts.cmake)
