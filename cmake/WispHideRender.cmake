# As on a machine without the packages of wisp::render, on one that has them: they are
# not found, and their headers, first in every search path, do not compile. The preset
# core has this as its CMAKE_PROJECT_INCLUDE.

include_guard(GLOBAL)

foreach(package embree OpenImageIO WispOpenImageIO OpenEXR Imath TinyGLTF)
  set(CMAKE_DISABLE_FIND_PACKAGE_${package} ON)
endforeach()

set(wisp_hidden_headers embree3/rtcore.h embree4/rtcore.h tiny_gltf.h half.h Imath/half.h)
foreach(name filesystem imagebuf imageio typedesc)
  list(APPEND wisp_hidden_headers OpenImageIO/${name}.h)
endforeach()
foreach(name ChannelList FrameBuffer Header IO InputFile OutputFile StringAttribute Threading)
  list(APPEND wisp_hidden_headers Imf${name}.h OpenEXR/Imf${name}.h)
endforeach()
foreach(header ${wisp_hidden_headers})
  file(WRITE ${CMAKE_BINARY_DIR}/hidden/${header}.new
    "#error \"${header} is of a package that this build does without\"\n")
  file(COPY_FILE ${CMAKE_BINARY_DIR}/hidden/${header}.new ${CMAKE_BINARY_DIR}/hidden/${header}
    ONLY_IF_DIFFERENT)
  file(REMOVE ${CMAKE_BINARY_DIR}/hidden/${header}.new)
endforeach()
include_directories(BEFORE ${CMAKE_BINARY_DIR}/hidden)
