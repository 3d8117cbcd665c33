#include <doctest/doctest.h>
#include <sys/resource.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <limits>
#include <random>

#include "image_module.h"
#include "wisp/render/image.h"

using namespace wisp;
namespace fs = std::filesystem;

namespace {

// A folder that is removed at the end.
struct temporary_folder {
  fs::path path =
      fs::temp_directory_path() / ("wisp-test-image-" + std::to_string(std::random_device{}()));
  temporary_folder() { fs::create_directories(path); }
  temporary_folder(const temporary_folder&) = delete;
  temporary_folder& operator=(const temporary_folder&) = delete;
  ~temporary_folder() {
    std::error_code ignored;
    fs::remove_all(path, ignored);
  }
};

std::vector<uint8_t> read_all(const fs::path& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
}
void write_all(const fs::path& path, const std::vector<uint8_t>& bytes) {
  std::ofstream out(path, std::ios::binary);
  out.write(reinterpret_cast<const char*>(bytes.data()),
            static_cast<std::streamsize>(bytes.size()));
}
std::size_t file_count(const fs::path& folder) {
  return static_cast<std::size_t>(
      std::distance(fs::directory_iterator(folder), fs::directory_iterator()));
}

image_data make_image(int width, int height, std::vector<std::string> channels) {
  image_data image;
  image.width = width;
  image.height = height;
  image.channels = std::move(channels);
  image.pixels.resize(static_cast<std::size_t>(width * height) * image.channels.size());
  for (std::size_t i = 0; i < image.pixels.size(); i++)
    image.pixels[i] = 0.01f + 0.37f * static_cast<float>((i * 7919) % 101) / 50;
  return image;
}

std::size_t channel_index(const image_data& image, const std::string& name) {
  for (std::size_t c = 0; c < image.channels.size(); c++)
    if (image.channels[c] == name) return c;
  FAIL("no channel " << name);
  return 0;
}

texture_data texture_of(const fs::path& path) {
  texture_data texture;
  texture.name = "test";
  texture.path = path;
  return texture;
}

std::string message_of(const auto& f) {
  try {
    f();
  } catch (const file_error& error) {
    return error.what();
  }
  return "";
}

void put_u16(std::vector<uint8_t>& out, unsigned v) {
  out.push_back(static_cast<uint8_t>(v & 255));
  out.push_back(static_cast<uint8_t>(v >> 8));
}

// A TGA without compression; bits 8 (grey), 24 or 32.
std::vector<uint8_t> make_tga(unsigned width, unsigned height, unsigned bits,
                              const std::vector<uint8_t>& data) {
  std::vector<uint8_t> out = {0, 0, static_cast<uint8_t>(bits == 8 ? 3 : 2), 0, 0, 0, 0, 0, 0, 0,
                              0, 0};
  put_u16(out, width);
  put_u16(out, height);
  out.push_back(static_cast<uint8_t>(bits));
  out.push_back(static_cast<uint8_t>(0x20 | (bits == 32 ? 8 : 0)));  // top row first
  out.insert(out.end(), data.begin(), data.end());
  return out;
}

uint32_t crc32(const std::vector<uint8_t>& bytes) {
  uint32_t crc = ~0u;
  for (auto byte : bytes) {
    crc ^= byte;
    for (int i = 0; i < 8; i++) crc = (crc >> 1) ^ (0xedb88320u & (0u - (crc & 1)));
  }
  return ~crc;
}

// A PNG whose rows are stored without compression. color: 0 grey, 2 rgb, 4
// grey and alpha, 6 rgba.
std::vector<uint8_t> make_png(uint32_t width, uint32_t height, uint8_t bits, uint8_t color,
                              const std::vector<uint8_t>& data) {
  std::vector<uint8_t> png = {0x89, 'P', 'N', 'G', 13, 10, 26, 10};
  auto be32 = [](std::vector<uint8_t>& out, uint32_t v) {
    for (int s = 24; s >= 0; s -= 8) out.push_back(static_cast<uint8_t>(v >> s));
  };
  auto chunk = [&](const char* type, const std::vector<uint8_t>& body) {
    be32(png, static_cast<uint32_t>(body.size()));
    std::vector<uint8_t> content(type, type + 4);
    content.insert(content.end(), body.begin(), body.end());
    png.insert(png.end(), content.begin(), content.end());
    be32(png, crc32(content));
  };
  std::vector<uint8_t> header;
  be32(header, width);
  be32(header, height);
  header.insert(header.end(), {bits, color, 0, 0, 0});
  chunk("IHDR", header);
  std::vector<uint8_t> raw;
  std::size_t row = height ? data.size() / height : 0;
  for (std::size_t y = 0; y < height && row > 0; y++) {
    raw.push_back(0);
    raw.insert(raw.end(), data.begin() + static_cast<std::ptrdiff_t>(y * row),
               data.begin() + static_cast<std::ptrdiff_t>((y + 1) * row));
  }
  uint32_t a = 1, b = 0;
  for (auto v : raw) a = (a + v) % 65521, b = (b + a) % 65521;
  std::vector<uint8_t> body = {0x78, 0x01, 1};
  put_u16(body, static_cast<unsigned>(raw.size()));
  put_u16(body, static_cast<unsigned>(~raw.size() & 0xffff));
  body.insert(body.end(), raw.begin(), raw.end());
  be32(body, b << 16 | a);
  chunk("IDAT", body);
  chunk("IEND", {});
  return png;
}

}  // namespace

TEST_CASE("image: exr keeps every channel, its values and metadata") {
  temporary_folder folder;
  auto image = make_image(37, 21, {"R", "G", "B", "A", "albedo.R", "albedo.G", "albedo.B", "Z"});
  image.metadata = {{"wisp:version", "0.1"}, {"comments", "a test"}};
  image.pixels[7] = 1e30f;  // a far depth
  auto path = folder.path / "image.exr";
  save_image(path, image);
  auto read = load_image(path);
  REQUIRE(read.width == 37);
  REQUIRE(read.height == 21);
  REQUIRE(read.channels.size() == image.channels.size());
  for (const auto& name : image.channels) {
    auto a = channel_index(image, name), b = channel_index(read, name);
    bool same = true;
    for (std::size_t i = 0; i < 37 * 21; i++)
      same = same && image.pixels[i * 8 + a] == read.pixels[i * 8 + b];
    CHECK_MESSAGE(same, "channel " << name);
  }
  bool found = false;
  for (const auto& [name, value] : read.metadata)
    if (name == "wisp:version") found = value == "0.1";
  CHECK(found);
  CHECK(file_count(folder.path) == 1);  // no temporary file is left
}

TEST_CASE("image: exr in half keeps depth as float, and never NaN or overflow") {
  temporary_folder folder;
  auto image = make_image(5, 4, {"R", "G", "B", "Z"});
  image.pixels[0] = std::numeric_limits<float>::quiet_NaN();
  image.pixels[1] = 1e9f;
  image.pixels[3] = 123456.789f;
  image_write_options options;
  options.half_float = true;
  auto path = folder.path / "half.exr";
  save_image(path, image, options);
  auto read = load_image(path);
  REQUIRE(read.channels.size() == 4);
  CHECK(read.pixels[channel_index(read, "R")] == 0);
  CHECK(read.pixels[channel_index(read, "G")] == 65504);
  CHECK(read.pixels[channel_index(read, "Z")] == 123456.789f);
  for (std::size_t i = 4; i < image.pixels.size(); i++)
    if (i % 4 != 3) CHECK(read.pixels[i] == doctest::Approx(image.pixels[i]).epsilon(0.001));
}

TEST_CASE("image: exr writes half where asked, and sorts no channel wrongly") {
  temporary_folder folder;
  // More rows than the writer takes at once, and no power of two.
  auto image = make_image(33, 150, {"Z", "albedo.R", "A", "B", "depth.Z", "G", "R", "error.V"});
  image.pixels[6] = -1e9f;
  for (bool half : {false, true}) {
    image_write_options options;
    options.half_float = half;
    auto path = folder.path / "image.exr";
    save_image(path, image, options);
    auto read = load_image(path);
    REQUIRE(read.channels.size() == 8);
    for (const auto& name : image.channels) {
      auto a = channel_index(image, name), b = channel_index(read, name);
      bool exact = !half || name == "Z" || name == "depth.Z";
      int differing = 0;
      float worst = 0;
      for (std::size_t i = 1; i < 33 * 150; i++) {
        float want = image.pixels[i * 8 + a], have = read.pixels[i * 8 + b];
        differing += want != have;
        worst = std::max(worst, std::abs(want - have) / want);
      }
      CAPTURE(name);
      CHECK((differing == 0) == exact);
      CHECK(worst < 1e-3f);
    }
    CHECK(read.pixels[channel_index(read, "R")] == (half ? -65504.0f : -1e9f));
  }
}

TEST_CASE("image: a large exr, which threads pack, is the same") {
  temporary_folder folder;
  auto image = make_image(1201, 397, {"R", "G", "B"});
  image.pixels[500000] = std::numeric_limits<float>::quiet_NaN();
  save_image(folder.path / "a.exr", image);
  image.pixels[500000] = 0;
  CHECK(load_image(folder.path / "a.exr").pixels == image.pixels);
}

TEST_CASE("image: exr metadata survives reading and writing again") {
  temporary_folder folder;
  auto image = make_image(3, 2, {"R", "G", "B"});
  std::string longer(100, 'n');
  image.metadata = {{"wisp:version", "0.1"}, {"comments", "first"},    {"owner", "somebody"},
                    {longer, "long name"},   {"type", "not an image"}, {"compression", "none"},
                    {"channels", "none"},    {"", "no name"},          {"empty", ""}};
  for (int i = 0; i < 2; i++) {
    save_image(folder.path / "a.exr", image);
    auto read = load_image(folder.path / "a.exr");
    std::vector<std::string> found;
    for (const auto& [name, value] : read.metadata) {
      // OpenImageIO has names of its own for some.
      if (name == "wisp:version") CHECK(value == "0.1");
      if (name == "comments" || name == "ImageDescription") CHECK(value == "first");
      if (name == "owner" || name == "Copyright") CHECK(value == "somebody");
      if (name == longer) CHECK(value == "long name");
      if (name == "compression") CHECK(value == "zip");
      CHECK(value != "not an image");
      found.push_back(name);
    }
    auto has = [&](const std::string& name) {
      return std::find(found.begin(), found.end(), name) != found.end();
    };
    CHECK(has("wisp:version"));
    CHECK(has(longer));
    CHECK((has("owner") || has("Copyright")));
    CHECK((has("comments") || has("ImageDescription")));
    CHECK(read.pixels == image.pixels);
    image = read;
  }
}

TEST_CASE("image: exr channels need names of their own") {
  temporary_folder folder;
  CHECK(message_of([&] {
          save_image(folder.path / "a.exr", make_image(2, 2, {"R", "G", "R"}));
        }).find("'R'") != std::string::npos);
  CHECK_THROWS_AS(save_image(folder.path / "a.exr", make_image(2, 2, {"R", ""})), file_error);
  CHECK_THROWS_AS(save_image(folder.path / "a.exr", make_image(2, 2, {std::string(300, 'c'), "R"})),
                  file_error);
  CHECK(file_count(folder.path) == 0);
}

TEST_CASE("image: a disk that is full is noticed, and the older file stays") {
  temporary_folder folder;
  std::vector<fs::path> paths;
  for (auto name : {"a.exr", "a.png", "a.hdr", "a.jpg"}) {
    paths.push_back(folder.path / name);
    save_image(paths.back(), make_image(2, 2, {"R", "G", "B"}));
  }
  // Noise, which no code packs well.
  auto image = make_image(200, 200, {"R", "G", "B"});
  std::mt19937 random(7);
  for (auto& p : image.pixels) p = static_cast<float>(random() % 65536) / 65536;
  rlimit before = {};
  getrlimit(RLIMIT_FSIZE, &before);
  auto handler = std::signal(SIGXFSZ, SIG_IGN);
  rlimit low = before;
  std::vector<std::string> messages;
  for (auto& path : paths)
    for (rlim_t bytes : {100, 5000}) {  // when the file is closed, and before
      low.rlim_cur = bytes;
      setrlimit(RLIMIT_FSIZE, &low);
      messages.push_back(message_of([&] { save_image(path, image); }));
      setrlimit(RLIMIT_FSIZE, &before);
    }
  std::signal(SIGXFSZ, handler);
  for (const auto& message : messages) {
    CAPTURE(message);
    CHECK(message.find("cannot be written") != std::string::npos);
  }
  for (const auto& path : paths) CHECK(load_image(path).width == 2);
  CHECK(file_count(folder.path) == paths.size());
}

TEST_CASE("image: a module that is missing or of no use") {
  temporary_folder folder;
  fs::create_directory(folder.path / "none");
  fs::create_directory(folder.path / "text");
  write_all(folder.path / "text" / "wisp_image_module.so", {'h', 'e', 'l', 'l', 'o'});
  std::string problem;
  CHECK(image_module::load({}, problem) == nullptr);
  CHECK(image_module::load({folder.path / "none", folder.path / "text"}, problem) == nullptr);
  CAPTURE(problem);
  for (const auto& word :
       {(folder.path / "none").string(), (folder.path / "text" / "wisp_image_module.so").string(),
        std::string("WISP_MODULE_DIR"), std::string("is not in")})
    CHECK(problem.find(word) != std::string::npos);
}

TEST_CASE("image: hdr holds the first three channels") {
  temporary_folder folder;
  auto image = make_image(20, 10, {"R", "G", "B", "A"});
  image.pixels[5] = -1;
  auto path = folder.path / "image.hdr";
  save_image(path, image);
  auto read = load_image(path);
  REQUIRE(read.width == 20);
  REQUIRE(read.channels.size() == 3);
  for (std::size_t i = 0; i < 200; i++) {
    float most = std::max({image.pixels[i * 4], image.pixels[i * 4 + 1], image.pixels[i * 4 + 2]});
    for (std::size_t c = 0; c < 3; c++)
      CHECK(std::abs(read.pixels[i * 3 + c] - std::max(0.0f, image.pixels[i * 4 + c])) <=
            most / 100);
  }
}

TEST_CASE("image: png and jpg hold what tonemap gives") {
  temporary_folder folder;
  image_data image;
  image.width = 64;
  image.height = 32;
  image.channels = {"R", "G", "B"};
  for (int i = 0; i < 64 * 32; i++) {
    float v = static_cast<float>(i % 64) / 32;
    image.pixels.insert(image.pixels.end(), {v, v * 0.8f, v * 0.6f});
  }
  image.pixels[0] = std::numeric_limits<float>::quiet_NaN();
  for (bool filmic : {false, true}) {
    image_write_options options;
    options.exposure = -0.5f;
    options.filmic = filmic;
    for (auto name : {"image.png", "image.jpg"}) {
      auto path = folder.path / name;
      save_image(path, image, options);
      auto texture = texture_of(path);
      load_texture(texture);
      REQUIRE(texture.pixelsb.size() == 64 * 32);
      float tolerance = fs::path(name).extension() == ".png" ? 0.51f : 12.0f;
      for (std::size_t i = 1; i < 64 * 32; i++) {
        auto* p = &image.pixels[i * 3];
        auto want = tonemap({p[0], p[1], p[2]}, options.exposure, filmic);
        for (int c = 0; c < 3; c++)
          REQUIRE(std::abs(static_cast<float>(texture.pixelsb[i][c]) - want[c] * 255) < tolerance);
        REQUIRE(texture.pixelsb[i].w == 255);
      }
    }
  }
}

TEST_CASE("image: tonemap is monotone, keeps mid-grey and stays in range") {
  auto grey = tonemap(vec3{0.18f}, 0, true);
  CHECK(grey.x == doctest::Approx(0.461).epsilon(0.01));
  CHECK(tonemap(vec3{0.18f}, 0, false).x == doctest::Approx(0.461).epsilon(0.01));
  CHECK(tonemap(vec3{0.09f}, 1, true).x == doctest::Approx(grey.x));
  CHECK((tonemap(vec3{1}, 0, false) == vec3{1}));
  CHECK(tonemap(vec3{20}, 0, true).x == 1);
  CHECK(tonemap(vec3{1}, 0, true).x < 0.95f);
  CHECK(tonemap(vec3{0}, 3, true) == vec3{0});
  CHECK(tonemap({-1, std::numeric_limits<float>::quiet_NaN(), 0}, 0, true) == vec3{0});
  CHECK(tonemap(vec3{infinity}, 0, true) == vec3{1});
  for (bool filmic : {false, true}) {
    for (vec3 tint : {vec3{1, 1, 1}, vec3{1, 0.2f, 0.05f}, vec3{0, 0.3f, 1}}) {
      auto before = tonemap(tint * std::exp2(-10.0f), 0, filmic);
      for (float e = -10; e < 10; e += 0.01f) {
        auto now = tonemap(tint * std::exp2(e), 0, filmic);
        for (int c = 0; c < 3; c++) {
          REQUIRE(now[c] >= before[c] - 1e-6f);
          REQUIRE(now[c] - before[c] < 0.01f);  // no jumps
          REQUIRE(now[c] <= 1);
        }
        before = now;
      }
    }
  }
  // Hue: the order of channels stays, and mid tones keep their ratios.
  auto red = tonemap({0.15f, 0.05f, 0.02f}, 0, true);
  auto plain = tonemap({0.15f, 0.05f, 0.02f}, 0, false);
  for (int c = 0; c < 3; c++) CHECK(red[c] == doctest::Approx(plain[c]).epsilon(0.01));
}

TEST_CASE("image: writing fails in plain words and leaves nothing") {
  temporary_folder folder;
  auto image = make_image(4, 4, {"R", "G", "B"});
  CHECK(message_of([&] { save_image(folder.path / "a.gif", image); }).find(".exr") !=
        std::string::npos);
  CHECK(message_of([&] {
          save_image(folder.path / "no" / "a.exr", image);
        }).find("does not exist") != std::string::npos);
  fs::create_directory(folder.path / "taken.png");
  CHECK(message_of([&] { save_image(folder.path / "taken.png", image); }).find("folder") !=
        std::string::npos);
  auto broken = image;
  broken.pixels.pop_back();
  CHECK_THROWS_AS(save_image(folder.path / "a.exr", broken), file_error);
  CHECK_THROWS_AS(save_image(folder.path / "a.exr", {}), file_error);
  CHECK(file_count(folder.path) == 1);
  CHECK(can_save_image("x.EXR"));
  CHECK_FALSE(can_save_image("x.bmp"));
  // An older file is replaced.
  save_image(folder.path / "a.exr", image);
  save_image(folder.path / "a.exr", make_image(7, 3, {"R", "G", "B"}));
  CHECK(load_image(folder.path / "a.exr").width == 7);
}

TEST_CASE("image: grey, grey and alpha, rgb and rgba textures") {
  temporary_folder folder;
  auto load = [&](const std::vector<uint8_t>& png) {
    auto path = folder.path / "t.png";
    write_all(path, png);
    auto texture = texture_of(path);
    load_texture(texture);
    REQUIRE(texture.width == 2);
    REQUIRE(texture.height == 1);
    REQUIRE(texture.pixelsf.empty());
    REQUIRE(texture.pixelsb.size() == 2);
    return texture.pixelsb;
  };
  auto grey = load(make_png(2, 1, 8, 0, {10, 200}));
  CHECK(grey[0] == u8vec4{10, 10, 10, 255});
  CHECK(grey[1] == u8vec4{200, 200, 200, 255});
  auto grey_alpha = load(make_png(2, 1, 8, 4, {10, 20, 200, 0}));
  CHECK(grey_alpha[0] == u8vec4{10, 10, 10, 20});
  CHECK(grey_alpha[1] == u8vec4{200, 200, 200, 0});  // colour stays where alpha is 0
  auto rgb = load(make_png(2, 1, 8, 2, {1, 2, 3, 4, 5, 6}));
  CHECK(rgb[1] == u8vec4{4, 5, 6, 255});
  auto rgba = load(make_png(2, 1, 8, 6, {1, 2, 3, 4, 250, 6, 7, 8}));
  CHECK(rgba[0] == u8vec4{1, 2, 3, 4});
  CHECK(rgba[1] == u8vec4{250, 6, 7, 8});
  // Sixteen bits are rounded to eight.
  auto deep = load(make_png(2, 1, 16, 0, {0x80, 0x80, 0x12, 0x34}));
  CHECK(deep[0].x == 0x80);
  CHECK(deep[1].x == 0x12);
}

TEST_CASE("image: tga textures") {
  temporary_folder folder;
  auto path = folder.path / "t.tga";
  write_all(path, make_tga(2, 1, 32, {3, 2, 1, 255, 6, 5, 4, 128}));
  auto texture = texture_of(path);
  load_texture(texture);
  REQUIRE(texture.pixelsb.size() == 2);
  CHECK(texture.pixelsb[0] == u8vec4{1, 2, 3, 255});
  CHECK(texture.pixelsb[1].x == 4);
  CHECK(texture.pixelsb[1].w == 128);
}

TEST_CASE("image: float textures are linear and finite") {
  temporary_folder folder;
  auto image = make_image(6, 5, {"R", "G", "B"});
  image.pixels[4] = infinity;
  auto path = folder.path / "t.exr";
  save_image(path, image);
  auto texture = texture_of(path);
  load_texture(texture);
  REQUIRE(texture.pixelsb.empty());
  REQUIRE(texture.pixelsf.size() == 30);
  CHECK(texture.pixelsf[0].x == image.pixels[0]);
  CHECK(texture.pixelsf[0].w == 1);
  CHECK(texture.pixelsf[1].y == 0);
  // one channel
  save_image(path, make_image(6, 5, {"Y"}));
  texture = texture_of(path);
  load_texture(texture);
  CHECK(texture.pixelsf[3].x == texture.pixelsf[3].z);
}

TEST_CASE("image: load_image decodes eight bits from sRGB") {
  temporary_folder folder;
  auto path = folder.path / "t.png";
  write_all(path, make_png(1, 1, 8, 6, {188, 0, 255, 128}));
  auto image = load_image(path);
  REQUIRE(image.pixels.size() == 4);
  CHECK(image.pixels[0] == doctest::Approx(0.5029).epsilon(0.001));
  CHECK(image.pixels[1] == 0);
  CHECK(image.pixels[2] == doctest::Approx(1));
  CHECK(image.pixels[3] == doctest::Approx(128 / 255.0));
}

TEST_CASE("image: textures encoded in memory") {
  temporary_folder folder;
  auto image = make_image(8, 8, {"R", "G", "B"});
  for (auto name : {"t.png", "t.jpg", "t.exr", "t.hdr"}) {
    save_image(folder.path / name, image);
    auto from_file = texture_of(folder.path / name);
    load_texture(from_file);
    texture_data from_memory;
    from_memory.name = "embedded";
    from_memory.encoded = read_all(folder.path / name);
    load_texture(from_memory);
    CHECK(from_memory.width == 8);
    CHECK(from_memory.pixelsb == from_file.pixelsb);
    CHECK(from_memory.pixelsf == from_file.pixelsf);
  }
  texture_data unknown;
  unknown.encoded = {1, 2, 3, 4};
  CHECK_THROWS_AS(load_texture(unknown), file_error);
  texture_data empty;
  CHECK_THROWS_AS(load_texture(empty), file_error);
}

TEST_CASE("image: missing, empty and wrong files") {
  temporary_folder folder;
  auto texture = texture_of(folder.path / "none.png");
  auto message = message_of([&] { load_texture(texture); });
  CHECK(message.find("file not found") != std::string::npos);
  CHECK(message.find("'test'") != std::string::npos);
  CHECK(message.find("none.png") != std::string::npos);
  CHECK_THROWS_AS(load_image(folder.path / "none.exr"), file_error);
  CHECK_THROWS_AS(load_image(folder.path), file_error);
  write_all(folder.path / "empty.png", {});
  CHECK_THROWS_AS(load_image(folder.path / "empty.png"), file_error);
  write_all(folder.path / "text.png", {'h', 'e', 'l', 'l', 'o'});
  CHECK_THROWS_AS(load_image(folder.path / "text.png"), file_error);
}

TEST_CASE("image: truncated files are errors") {
  temporary_folder folder;
  auto image = make_image(64, 64, {"R", "G", "B"});
  for (auto name : {"t.png", "t.jpg", "t.exr", "t.hdr"}) {
    save_image(folder.path / name, image);
    auto bytes = read_all(folder.path / name);
    for (std::size_t part = 1; part < 10; part++) {
      auto cut = bytes;
      cut.resize(bytes.size() * part / 10);
      write_all(folder.path / (std::string("cut-") + name), cut);
      auto texture = texture_of(folder.path / (std::string("cut-") + name));
      CHECK_MESSAGE(!message_of([&] { load_texture(texture); }).empty(), name << " " << part);
      CHECK(texture.pixelsb.empty());
      CHECK(texture.pixelsf.empty());
      texture_data memory;
      memory.encoded = cut;
      CHECK_MESSAGE(!message_of([&] { load_texture(memory); }).empty(), name << " " << part);
    }
  }
}

TEST_CASE("image: sizes that the file cannot hold are refused before memory is") {
  temporary_folder folder;
  for (auto [w, h] : {std::pair{60000u, 60000u}, std::pair{30000u, 30000u}}) {
    write_all(folder.path / "huge.png", make_png(w, h, 8, 6, {}));
    auto texture = texture_of(folder.path / "huge.png");
    CHECK_THROWS_AS(load_texture(texture), file_error);
    CHECK_THROWS_AS(load_image(folder.path / "huge.png"), file_error);
  }
  write_all(folder.path / "huge.tga", make_tga(60000, 60000, 32, {1, 2, 3, 4}));
  auto texture = texture_of(folder.path / "huge.tga");
  CHECK_THROWS_AS(load_texture(texture), file_error);
}

TEST_CASE("image: load_textures loads what is used, and counts its bytes") {
  temporary_folder folder;
  save_image(folder.path / "a.png", make_image(8, 4, {"R", "G", "B"}));
  save_image(folder.path / "b.exr", make_image(3, 2, {"R", "G", "B"}));
  scene_data scene;
  scene.textures = {texture_of(folder.path / "a.png"), texture_of(folder.path / "missing.png"),
                    texture_of(folder.path / "b.exr")};
  CHECK(load_textures(scene, {true, false, true}) == 8 * 4 * 4 + 3 * 2 * 16);
  CHECK(scene.textures[0].width == 8);
  CHECK(scene.textures[1].width == 0);
  CHECK(scene.textures[2].height == 2);
  CHECK(load_textures(scene, {true, false, true}) == 8 * 4 * 4 + 3 * 2 * 16);
  CHECK_THROWS_AS(load_textures(scene, {true, true, true}, 2), file_error);
}

TEST_CASE("image: files of the test data") {
  const char* data = std::getenv("WISP_TEST_DATA");
  if (!data) {
    MESSAGE("skipped: WISP_TEST_DATA is not set");
    return;
  }
  int count = 0;
  for (auto folder : {"env", "yocto/features1/textures", "yocto/shapes1/textures", "hair-ball"}) {
    std::error_code error;
    for (const auto& entry : fs::directory_iterator(fs::path(data) / folder, error)) {
      auto extension = entry.path().extension().string();
      if (extension != ".hdr" && extension != ".exr" && extension != ".png") continue;
      auto texture = texture_of(entry.path());
      load_texture(texture);
      CHECK(texture.width > 0);
      CHECK((texture.pixelsf.empty() == (extension == ".png")));
      auto image = load_image(entry.path());
      CHECK(image.width == texture.width);
      count++;
    }
  }
  CHECK(count > 0);
}
