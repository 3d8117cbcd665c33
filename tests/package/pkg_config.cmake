# Compiles MAIN with no more than the compiler, FLAGS and what pkg-config says of
# wisp-COMPONENT in the install PREFIX, and runs it.
cmake_minimum_required(VERSION 3.23)
file(GLOB_RECURSE files ${PREFIX}/wisp-${COMPONENT}.pc)
list(LENGTH files count)
if(NOT count EQUAL 1)
  message(FATAL_ERROR "there should be one wisp-${COMPONENT}.pc in ${PREFIX}: ${files}")
endif()
get_filename_component(folder ${files} DIRECTORY)
set(ENV{PKG_CONFIG_PATH} ${folder})

# query(OUT OPTIONS...)
function(query out)
  execute_process(COMMAND ${PKG_CONFIG} ${ARGN} wisp-${COMPONENT}
    OUTPUT_VARIABLE text ERROR_VARIABLE problem RESULT_VARIABLE result
    OUTPUT_STRIP_TRAILING_WHITESPACE)
  if(NOT result EQUAL 0)
    message(FATAL_ERROR "pkg-config ${ARGN} wisp-${COMPONENT}: ${problem}")
  endif()
  separate_arguments(text UNIX_COMMAND "${text}")
  set(${out} ${text} PARENT_SCOPE)
endfunction()

query(version --modversion)
if(NOT version STREQUAL WANTED)
  message(FATAL_ERROR "wisp-${COMPONENT}.pc is of version ${version}, not ${WANTED}")
endif()
query(flags --cflags)
query(libraries --libs)
message(STATUS "${flags} ${libraries}")
if(SHARED AND (libraries MATCHES "tbb|hwy" OR flags MATCHES "WISP_STATIC"))
  message(FATAL_ERROR "what a shared library has inside is not for its users to link")
endif()

separate_arguments(FLAGS UNIX_COMMAND "${FLAGS}")
set(program ${WORK}/${COMPONENT})
file(REMOVE ${program})
file(MAKE_DIRECTORY ${WORK})
execute_process(COMMAND ${CXX} ${FLAGS} ${flags} ${MAIN} -o ${program} ${libraries}
  COMMAND_ERROR_IS_FATAL ANY)
if(SHARED)
  get_filename_component(ENV{LD_LIBRARY_PATH} ${folder} DIRECTORY)
endif()
execute_process(COMMAND ${program} WORKING_DIRECTORY ${WORK} COMMAND_ERROR_IS_FATAL ANY)
