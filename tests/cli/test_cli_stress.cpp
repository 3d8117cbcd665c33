// `wisp stress` in its short form.

#include <doctest/doctest.h>

#include <sstream>
#include <string>

#include "run_command.h"

TEST_CASE("cli: stress computes its cases, and none fails") {
  folder f;
  auto o = run({"stress", "--calls", "100000", "--seed", "3", "-o", f / "table.md"});
  CAPTURE(o.out);
  CAPTURE(o.err);
  CHECK(o.status == 0);
  CHECK(o.err.empty());
  CHECK(read_file(f / "table.md") == o.out);
  // A table of Markdown: as many columns in each row as in its head.
  std::stringstream lines(o.out);
  int rows = 0, ok = 0;
  for (std::string line; std::getline(lines, line);) {
    if (line.empty() || line[0] != '|') continue;
    rows++;
    CHECK(std::count(line.begin(), line.end(), '|') == 7);
    ok += line.find("| ok |") != std::string::npos;
  }
  CHECK(rows > 160);
  CHECK(ok == rows - 2);
  CHECK(o.out.find("NaN or infinite, float, 100000 calls | none | 0") != std::string::npos);
  // all parts of it
  for (const char* part : {"closest point, slivers of aspect 1e+08", "mesh of a ball in 128",
                           "winding number of half a ball", "signed distance of ellipsoids",
                           "hit of a ray that passes a ball", "start on a vertex"}) {
    CAPTURE(part);
    CHECK(o.out.find(part) != std::string::npos);
  }
}

TEST_CASE("cli: stress refuses what it cannot do") {
  CHECK(run({"stress", "--help"}).out.find("Example:") != std::string::npos);
  CHECK(run({"stress", "--calls", "0"}).status == 2);
  CHECK(run({"stress", "--calls", "many"}).status == 2);
  CHECK(run({"stress", "--threads", "-1"}).status == 2);
  folder f;
  check_fault(f, {"stress", "--calls", "1", "-o", f / "no/such/table.md"}, {"table.md"});
}
