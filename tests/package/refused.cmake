# find_package has to fail, and to say why, for: a version, a component that does not
# exist, and a component whose packages are not there. PREFIX is the install, WORK a folder
# to work in; RENDER says whether the component render is installed.
cmake_minimum_required(VERSION 3.23)
set(source ${WORK}/source)
file(WRITE ${source}/CMakeLists.txt "\
cmake_minimum_required(VERSION 3.23)
project(wisp_consumer LANGUAGES CXX)
find_package(wisp \${WANTED})
message(STATUS \"it was found\")
")

# refuse(NAME ARGUMENTS EXPECTED [-D...]): ARGUMENTS of find_package.
function(refuse name arguments expected)
  file(REMOVE_RECURSE ${WORK}/${name})
  execute_process(
    COMMAND ${CMAKE_COMMAND} -S ${source} -B ${WORK}/${name} -G ${GENERATOR}
      -DCMAKE_MAKE_PROGRAM=${MAKE} -DCMAKE_CXX_COMPILER=${CXX} -Dwisp_ROOT=${PREFIX}
      -DCMAKE_FIND_PACKAGE_NO_PACKAGE_REGISTRY=ON "-DWANTED=${arguments}" ${ARGN}
    RESULT_VARIABLE result OUTPUT_VARIABLE text ERROR_VARIABLE text)
  string(REGEX REPLACE "[ \n]+" " " text "${text}")
  if(result EQUAL 0)
    message(FATAL_ERROR "find_package(wisp ${arguments}) is not refused")
  endif()
  if(NOT text MATCHES "${expected}")
    message(FATAL_ERROR "find_package(wisp ${arguments}) does not say \"${expected}\": ${text}")
  endif()
  message(STATUS "find_package(wisp ${arguments}): ${expected}")
endfunction()

refuse(newer "0.2;REQUIRED;COMPONENTS;hair" "compatible with requested version \"0.2\"")
refuse(older "0.0.9;REQUIRED;COMPONENTS;hair" "compatible with requested version \"0.0.9\"")
refuse(exact "0.1.99;EXACT;REQUIRED;COMPONENTS;hair" "requested version \"0.1.99\"")
refuse(component "REQUIRED;COMPONENTS;hair;fur"
  "There is no component fur; what is installed here is core, hair")
refuse(package "REQUIRED;COMPONENTS;core" "component core needs the package glm, which is not found"
  -DCMAKE_DISABLE_FIND_PACKAGE_glm=ON)
refuse(inner "REQUIRED;COMPONENTS;hair;pde"
  "component core needs the package glm, which is not found"
  -DCMAKE_DISABLE_FIND_PACKAGE_glm=ON)
refuse(everything "REQUIRED" "needs the package glm, which is not found"
  -DCMAKE_DISABLE_FIND_PACKAGE_glm=ON)
