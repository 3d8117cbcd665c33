# What the preset core hides is what wisp::render includes, and the command links none of
# it. Run with HIDDEN (the folder of headers that do not compile), SOURCES (of
# wisp::render) and COMMAND.

set(bad "")
file(GLOB files ${SOURCES}/*.cpp ${SOURCES}/*.h)
set(seen 0)
foreach(file ${files})
  file(STRINGS ${file} lines REGEX "^#include <(embree|OpenImageIO|OpenEXR|Imath|Imf|half|tiny_gltf)")
  foreach(line ${lines})
    math(EXPR seen "${seen} + 1")
    string(REGEX REPLACE "^#include <([^>]*)>.*" "\\1" header "${line}")
    if(NOT EXISTS ${HIDDEN}/${header})
      list(APPEND bad "${header}, which ${file} includes, is not hidden")
    endif()
  endforeach()
endforeach()
if(seen EQUAL 0)
  list(APPEND bad "no source in ${SOURCES} includes what is hidden")
endif()

file(GET_RUNTIME_DEPENDENCIES EXECUTABLES ${COMMAND}
  RESOLVED_DEPENDENCIES_VAR resolved UNRESOLVED_DEPENDENCIES_VAR unresolved)
if(NOT "${resolved}" MATCHES "libtbb")
  list(APPEND bad "the libraries of ${COMMAND} could not be told")
endif()
foreach(library ${resolved} ${unresolved})
  if(library MATCHES "/lib(embree|OpenImageIO|OpenEXR|Imath|Iex|tinygltf)[^/]*$")
    list(APPEND bad "${COMMAND} links ${library}")
  endif()
endforeach()

if(bad)
  list(JOIN bad "\n  " text)
  message(FATAL_ERROR "${text}")
endif()
