#pragma once

// Runs the command as a user would, and scenes for it.

#include <doctest/doctest.h>
#include <fcntl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

namespace fs = std::filesystem;

// Whether the command has the render component.
inline constexpr bool has_render = WISP_HAS_RENDER;

struct outcome {
  int status = -1;
  std::string out, err;
};

inline std::string read_file(const fs::path& path) {
  std::ifstream in(path, std::ios::binary);
  std::stringstream text;
  text << in.rdbuf();
  return text.str();
}

// A folder of its own for each test, removed at the end.
struct folder {
  fs::path path;
  folder() {
    std::string name = (fs::temp_directory_path() / "wisp-cli-XXXXXX").string();
    path = mkdtemp(name.data());
  }
  ~folder() {
    std::error_code ignored;
    fs::remove_all(path, ignored);
  }
  folder(const folder&) = delete;
  folder& operator=(const folder&) = delete;
  std::string operator/(const std::string& name) const { return (path / name).string(); }
  std::string write(const std::string& name, const std::string& text) const {
    std::ofstream(path / name, std::ios::binary) << text;
    return (path / name).string();
  }
  std::size_t files() const {
    return std::size_t(std::distance(fs::directory_iterator(path), fs::directory_iterator()));
  }
};

inline pid_t start(const std::vector<std::string>& args, const fs::path& out, const fs::path& err) {
  pid_t pid = fork();
  if (pid == 0) {
    auto redirect = [](const fs::path& path, int to) {
      int fd = open(path.c_str(), O_CREAT | O_TRUNC | O_WRONLY, 0600);
      dup2(fd, to);
    };
    redirect(out, 1);
    redirect(err, 2);
    std::vector<char*> argv = {const_cast<char*>(WISP_COMMAND)};
    for (const auto& a : args) argv.push_back(const_cast<char*>(a.c_str()));
    argv.push_back(nullptr);
    execv(WISP_COMMAND, argv.data());
    _exit(127);
  }
  return pid;
}

inline int finish(pid_t pid) {
  int status = 0;
  waitpid(pid, &status, 0);
  return WIFEXITED(status) ? WEXITSTATUS(status) : 1000 + WTERMSIG(status);
}

inline outcome run(const std::vector<std::string>& args) {
  folder logs;
  outcome o;
  o.status = finish(start(args, logs.path / "out", logs.path / "err"));
  o.out = read_file(logs.path / "out");
  o.err = read_file(logs.path / "err");
  return o;
}

// Fails with one message that holds the words, exit status 1, and no new file.
inline void check_fault(const folder& f, const std::vector<std::string>& args,
                        const std::vector<std::string>& words) {
  auto files = f.files();
  auto o = run(args);
  CAPTURE(o.err);
  CHECK(o.status == 1);
  CHECK(std::count(o.err.begin(), o.err.end(), '\n') == 1);
  CHECK(o.err.rfind("wisp: error: ", 0) == 0);
  for (const auto& w : words) {
    CAPTURE(w);
    CHECK(o.err.find(w) != std::string::npos);
  }
  CHECK(f.files() == files);
}

// A lit square; `extra` goes into the file's object.
inline std::string simple_scene(const folder& f, const std::string& extra = "") {
  f.write("square.obj",
          "v -1 0 1\nv 1 0 1\nv 1 0 -1\nv -1 0 -1\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nf 1/1 2/2 3/3 "
          "4/4\n");
  return f.write("scene.json", R"({"asset": {"version": "4.2"},
    "cameras": [{"name": "main", "lookat": [0, 2, 3, 0, 0, 0, 0, 1, 0], "aspect": 1.5},
                {"name": "top", "lookat": [0, 3, 0.01, 0, 0, 0, 0, 1, 0], "aspect": 1}],
    "environments": [{"name": "sky", "emission": [1, 1, 1]}],
    "shapes": [{"name": "square", "uri": "square.obj"}],
    "materials": [{"name": "grey", "type": "matte", "color": [0.5, 0.5, 0.5]}],
    "instances": [{"shape": 0, "material": 0}])" +
                                   extra + "}");
}

inline std::vector<std::string> quick(const std::string& scene, const std::string& out) {
  return {"render", scene, "-o", out, "--resolution", "24x16", "--samples", "4"};
}

inline std::vector<std::string> operator+(std::vector<std::string> a,
                                          const std::vector<std::string>& b) {
  a.insert(a.end(), b.begin(), b.end());
  return a;
}
