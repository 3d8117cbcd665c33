# OpenImageIO by its header and libraries. The package config that Debian and
# Ubuntu ship names headers (OpenCV) and programs of other packages that nothing
# here needs; this asks for none of them.
#
# Defines wisp_openimageio.

include(FindPackageHandleStandardArgs)

find_path(WispOpenImageIO_INCLUDE_DIR OpenImageIO/imageio.h)
find_library(WispOpenImageIO_LIBRARY OpenImageIO)
find_library(WispOpenImageIO_Util_LIBRARY OpenImageIO_Util)
mark_as_advanced(WispOpenImageIO_INCLUDE_DIR WispOpenImageIO_LIBRARY WispOpenImageIO_Util_LIBRARY)
find_package_handle_standard_args(WispOpenImageIO
  REQUIRED_VARS WispOpenImageIO_LIBRARY WispOpenImageIO_Util_LIBRARY WispOpenImageIO_INCLUDE_DIR)

if(WispOpenImageIO_FOUND AND NOT TARGET wisp_openimageio)
  find_package(Imath REQUIRED)
  add_library(wisp_openimageio INTERFACE IMPORTED)
  target_include_directories(wisp_openimageio SYSTEM INTERFACE ${WispOpenImageIO_INCLUDE_DIR})
  target_link_libraries(wisp_openimageio INTERFACE
    ${WispOpenImageIO_LIBRARY} ${WispOpenImageIO_Util_LIBRARY} Imath::Imath)
endif()
