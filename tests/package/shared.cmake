# Builds the libraries of the core as shared ones, in BUILD, and installs them to PREFIX.
# Quick to compile rather than quick to run.
cmake_minimum_required(VERSION 3.23)
file(REMOVE_RECURSE ${PREFIX})
execute_process(
  COMMAND ${CMAKE_COMMAND} -S ${SOURCE} -B ${BUILD} -G ${GENERATOR}
    -DCMAKE_MAKE_PROGRAM=${MAKE} -DCMAKE_CXX_COMPILER=${CXX}
    -DCMAKE_CXX_COMPILER_LAUNCHER=${LAUNCHER} -DCMAKE_BUILD_TYPE=Release
    "-DCMAKE_CXX_FLAGS_RELEASE=-O1 -DNDEBUG" -DBUILD_SHARED_LIBS=ON -DWISP_BUILD_RENDER=OFF
    -DWISP_BUILD_APP=OFF -DWISP_BUILD_TESTS=OFF
  COMMAND_ERROR_IS_FATAL ANY)
execute_process(COMMAND ${CMAKE_COMMAND} --build ${BUILD} -j 2 COMMAND_ERROR_IS_FATAL ANY)
execute_process(COMMAND ${CMAKE_COMMAND} --install ${BUILD} --prefix ${PREFIX}
  COMMAND_ERROR_IS_FATAL ANY)
file(GLOB_RECURSE archives ${PREFIX}/*.a)
file(GLOB_RECURSE libraries ${PREFIX}/libwisp_*.so)
list(LENGTH libraries count)
if(archives OR count LESS 4)
  message(FATAL_ERROR "a shared build installs shared libraries: ${libraries} ${archives}")
endif()
# They find one another beside them, wherever that is.
foreach(library ${libraries})
  execute_process(COMMAND ${READELF} -dW ${library} OUTPUT_VARIABLE text COMMAND_ERROR_IS_FATAL ANY)
  if(NOT text MATCHES "(RUNPATH|RPATH)[^\n]*\\[\\$ORIGIN[:a-z/.$A-Z]*\\]" OR
      text MATCHES "\\[${BUILD}")
    message(FATAL_ERROR "${library} does not look beside itself: ${text}")
  endif()
endforeach()
