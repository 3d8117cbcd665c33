# Packs what the libraries are built from, and no more, into ARCHIVE.
cmake_minimum_required(VERSION 3.23)
file(REMOVE ${ARCHIVE})
execute_process(
  COMMAND ${CMAKE_COMMAND} -E tar czf ${ARCHIVE} CMakeLists.txt LICENSE cmake libs
  WORKING_DIRECTORY ${SOURCE} COMMAND_ERROR_IS_FATAL ANY)
