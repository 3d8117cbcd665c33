// Writing of OpenEXR files (https://openexr.com/en/latest/TechnicalIntroduction.html):
// one part of scan lines, any channels, ZIP compression.

#include "image_exr.h"

#include <ImfChannelList.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfIO.h>
#include <ImfOutputFile.h>
#include <ImfStringAttribute.h>
#include <ImfThreading.h>
#include <half.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <cstdint>
#include <new>
#include <string_view>

#include "wisp/core/parallel.h"

namespace wisp {

namespace fs = std::filesystem;

namespace {

// OpenEXR swallows exceptions where it finishes a file: the first error is kept
// here, and what follows goes nowhere.
class exr_stream : public Imf::OStream {
 public:
  exr_stream(std::FILE* file, const char* name) : OStream(name), file_(file) {}

  void write(const char bytes[], int count) override {
    auto n = static_cast<std::size_t>(std::max(count, 0));
    errno = 0;
    if (!error_ && std::fwrite(bytes, 1, n, file_) != n) error_ = errno ? errno : EIO;
    position_ += n;
  }
  uint64_t tellp() override { return position_; }
  void seekp(uint64_t position) override {
    errno = 0;
    if (!error_ && fseeko(file_, static_cast<off_t>(position), SEEK_SET) != 0)
      error_ = errno ? errno : EIO;
    position_ = position;
  }
  int error() const { return error_; }

 private:
  std::FILE* file_;
  uint64_t position_ = 0;
  int error_ = 0;
};

bool is_depth_channel(std::string_view name) {
  if (auto dot = name.rfind('.'); dot != std::string_view::npos) {
    if (name.substr(0, dot) == "depth") return true;
    name = name.substr(dot + 1);
  }
  return name == "Z" || name == "z" || name == "depth";
}

// Names of texts that have a standard name in OpenEXR, as load_image reads them.
std::string attribute_name(const std::string& name) {
  if (name == "Copyright") return "owner";
  if (name == "DateTime") return "capDate";
  if (name == "ImageDescription") return "comments";
  return name;
}

// Texts about the file that was read, not the one to write, and names that the
// format keeps for itself.
bool is_reserved(const Imf::Header& header, const std::string& name) {
  static constexpr std::array<std::string_view, 6> of_format = {"type",       "name",  "version",
                                                                "chunkCount", "tiles", "preview"};
  if (name.empty() || name.starts_with("oiio:") || name.starts_with("openexr:")) return true;
  if (std::find(of_format.begin(), of_format.end(), name) != of_format.end()) return true;
  return header.find(name) != header.end() &&
         !header.findTypedAttribute<Imf::StringAttribute>(name);
}

Imf::Header make_header(const image_data& image, const std::vector<bool>& half) {
  Imf::Header header(image.width, image.height);
  header.compression() = Imf::ZIP_COMPRESSION;
  for (std::size_t c = 0; c < image.channels.size(); c++)
    header.channels().insert(image.channels[c], Imf::Channel(half[c] ? Imf::HALF : Imf::FLOAT));
  for (const auto& [name, value] : image.metadata)
    if (auto known = attribute_name(name); !is_reserved(header, known))
      header.insert(known, Imf::StringAttribute(value));
  return header;
}

// OpenEXR packs with the threads of a pool of the whole process, which is empty
// unless someone has filled it. Returns their number.
int fill_thread_pool() {
  static const bool filled = [] {
    if (Imf::globalThreadCount() == 0) Imf::setGlobalThreadCount(thread_count(0));
    return true;
  }();
  static_cast<void>(filled);
  return Imf::globalThreadCount();
}

void write_pixels(Imf::OutputFile& output, const image_data& image, const std::vector<bool>& half,
                  int threads) {
  constexpr float half_max = HALF_MAX;
  constexpr std::size_t block = 16;  // rows that are packed together
  std::size_t n = image.channels.size(), width = static_cast<std::size_t>(image.width);
  std::size_t height = static_cast<std::size_t>(image.height);
  std::size_t band = std::min(height, block * static_cast<std::size_t>(std::max(4, 2 * threads)));
  std::vector<::half> halves;
  if (std::find(half.begin(), half.end(), true) != half.end()) halves.resize(width * n * band);
  std::vector<float> repaired;
  for (std::size_t y = 0; y < height; y += band) {
    std::size_t rows = std::min(band, height - y);
    const float* floats = image.pixels.data() + y * width * n;
    // What a viewer would choke on is repaired in a copy, made only when needed.
    if (std::any_of(floats, floats + rows * width * n, [](float v) { return std::isnan(v); })) {
      repaired.assign(floats, floats + rows * width * n);
      for (auto& v : repaired)
        if (std::isnan(v)) v = 0;
      floats = repaired.data();
    }
    for (std::size_t c = 0; c < n; c++)
      for (std::size_t i = c; half[c] && i < rows * width * n; i += n)
        halves[i] = ::half(std::clamp(floats[i], -half_max, half_max));
    Imf::FrameBuffer buffer;
    for (std::size_t c = 0; c < n; c++) {
      // A slice begins where pixel (0, 0) of the whole image would be. It has no
      // const, though writing only reads.
      auto slice = [&](Imf::PixelType type, const auto* data) {
        std::size_t size = sizeof(*data);
        auto origin = reinterpret_cast<uintptr_t>(data + c) - y * width * n * size;
        buffer.insert(image.channels[c], Imf::Slice(type, reinterpret_cast<char*>(origin), n * size,
                                                    width * n * size));
      };
      half[c] ? slice(Imf::HALF, halves.data()) : slice(Imf::FLOAT, floats);
    }
    output.setFrameBuffer(buffer);
    output.writePixels(static_cast<int>(rows));
  }
}

}  // namespace

bool write_exr(std::FILE* file, const fs::path& path, const image_data& image,
               const image_write_options& options) {
  auto fail = [&](const std::string& reason) { throw file_error{path.string(), "", reason}; };
  std::vector<bool> half(image.channels.size(), false);
  for (std::size_t c = 0; c < half.size(); c++) {
    const auto& name = image.channels[c];
    if (name.empty()) fail("a channel of the image to write has no name");
    if (name.size() > 255) fail("names of channels have at most 255 bytes, unlike '" + name + "'");
    if (std::count(image.channels.begin(), image.channels.end(), name) > 1)
      fail("the image to write has two channels of the name '" + name + "'");
    half[c] = options.half_float && !is_depth_channel(name);
  }
  try {
    exr_stream stream(file, path.c_str());
    {
      // Threads are not worth their making for a few blocks.
      int threads = image.pixels.size() > (1u << 20) ? fill_thread_pool() : 0;
      Imf::OutputFile output(stream, make_header(image, half), threads);
      write_pixels(output, image, half, threads);
    }
    errno = stream.error();
    return errno == 0;
  } catch (const std::bad_alloc&) {
    throw;
  } catch (const std::exception& error) {
    fail(std::string("cannot be written: ") + error.what());
  }
  return false;
}

}  // namespace wisp
