#pragma once

// Tokens of pbrt's scene format, versions 3 and 4, through included files.

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "wisp/core/error.h"

namespace wisp {

enum struct pbrt_token_type { end, word, text, number, open, close };

struct pbrt_token {
  pbrt_token_type type = pbrt_token_type::end;
  std::string text = "";  // of a word, or of a string without its quotes
  double number = 0;
};

// A parameter of a directive: "type name" and its values.
struct pbrt_parameter {
  std::string type = "";
  std::string name = "";
  std::vector<std::string> texts = {};  // strings, and true and false
  std::vector<double> numbers = {};
};

class pbrt_tokens {
 public:
  // Included files are looked for in the folder of `file`.
  pbrt_tokens(std::string text, std::string file);

  const pbrt_token& peek();
  pbrt_token next();
  double number();  // the next token, which must be a number
  // `count` numbers, with or without brackets around them.
  std::vector<double> numbers(std::size_t count);
  std::string text();  // the next token, which must be a string
  std::vector<pbrt_parameter> parameters();
  // Goes past everything that is not a word, and so to the next directive.
  void skip_arguments();
  // Goes on with another file; the tokens after return to this one at its end.
  void include(const std::string& name);
  [[noreturn]] void fail(const std::string& reason) const;

 private:
  struct source {
    std::string text;
    std::string file;
    std::size_t at = 0;
    std::size_t line = 1;
  };

  pbrt_token read();

  std::vector<source> sources_;
  std::filesystem::path base_;
  std::optional<pbrt_token> ahead_;
  int includes_ = 0;
};

}  // namespace wisp
