# All public headers of an install in one source, in either order: no name may mean two
# things.
cmake_minimum_required(VERSION 3.23)
file(GLOB headers RELATIVE ${PREFIX}/include ${PREFIX}/include/wisp/*/*.h)
list(LENGTH headers count)
if(count LESS 30)
  message(FATAL_ERROR "there are ${count} headers in ${PREFIX}/include: this looks at nothing")
endif()
foreach(order forwards backwards)
  list(TRANSFORM headers REPLACE "(.+)" "#include \"\\1\"\n" OUTPUT_VARIABLE text)
  list(JOIN text "" text)
  file(WRITE ${WORK}/${order}.cpp "${text}")
  execute_process(
    COMMAND ${CXX} -std=c++20 -Wall -Wextra -Werror -I${PREFIX}/include -fsyntax-only
      ${WORK}/${order}.cpp
    COMMAND_ERROR_IS_FATAL ANY)
  list(REVERSE headers)
endforeach()
message(STATUS "${count} headers")
