// The image module: what it gives to wisp_render, and encoding by OpenImageIO.

#include "image_module.h"

#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>

namespace wisp::image_module {

namespace {

// The first line of a message of OpenImageIO, without its line end.
std::string first_line(std::string message, const char* otherwise) {
  if (auto end = message.find_first_of("\r\n"); end != std::string::npos) message.resize(end);
  return message.empty() ? otherwise : message;
}

}  // namespace

std::vector<uint8_t> encode(const encode_job& job) {
  auto fail = [&](const std::string& reason) { throw file_error{job.target.string(), "", reason}; };
  auto format = job.floats.empty() ? OIIO::TypeDesc::UINT8 : OIIO::TypeDesc::FLOAT;
  const void* pixels = job.floats.empty() ? static_cast<const void*>(job.bytes.data())
                                          : static_cast<const void*>(job.floats.data());
  OIIO::ImageSpec spec(job.width, job.height, 3, format);
  if (!job.compression.empty()) spec.attribute("Compression", job.compression);
  for (const auto& [name, value] : job.metadata) spec.attribute(name, value);

  auto name = job.beside.string();
  auto output = OIIO::ImageOutput::create(name);
  if (!output) fail(first_line(OIIO::geterror(), "no writer for this format is installed"));
  std::vector<uint8_t> bytes;
  OIIO::Filesystem::IOVecOutput proxy(bytes);
  if (output->supports("ioproxy")) output->set_ioproxy(&proxy);
  if (!output->open(name, spec) || !output->write_image(format, pixels) || !output->close())
    fail("cannot be written: " + first_line(output->geterror(), "unknown reason"));
  output.reset();
  return bytes;
}

}  // namespace wisp::image_module

const wisp_image_functions* wisp_image_module() {
  using namespace wisp::image_module;
  static constexpr wisp_image_functions functions = {
      {sizes[0], sizes[1], sizes[2], sizes[3]}, WISP_VERSION, &read_texture, &read_image, &encode};
  return &functions;
}
