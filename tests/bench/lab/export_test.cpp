// Exports of recordings: names of stations, and times.
#include <unistd.h>

#include <catch2/catch.hpp>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <set>
#include <string>

#include "bench/lab/session_csv.hpp"
#include "bench/lab/session_shapes.hpp"
#include "tests/common/record/small_recording.hpp"

using namespace palpate;

namespace {

struct ExportFolder {
  std::filesystem::path path = std::filesystem::temp_directory_path() / ("palpate-export-" + std::to_string(::getpid()));
  ExportFolder() { std::filesystem::create_directories(path); }
  ~ExportFolder() { std::filesystem::remove_all(path); }
  std::string text(const std::string& file) const {
    std::ifstream in(path / file);
    return {std::istreambuf_iterator<char>(in), {}};
  }
};

RecordedEvent joins(StationId id, const std::string& name, Micros t) {
  RecordedEvent event;
  event.t = t;
  event.station = id;
  event.name = name;
  return event;
}

}  // namespace

TEST_CASE("Every station has a folder of its own, and none has the name of a file of the export") {
  StationFolders folders;
  std::set<std::string> all{"shapes", "shapes.pvd", "summary.json", "events.csv", "frames.csv"};
  for (const char* name :
       {"OR 3", "OR_3", "or_3", "OR/3", "OR 3-2", "summary.json", "events.csv", "shapes", "Shapes", "..", ".", "手"})
    CHECK(all.insert(folders.of(name)).second);
  CHECK(folders.of("OR 3") == "OR_3");
  CHECK(folders.of("OR_3") == "OR_3-2");
  CHECK(folders.of("summary.json") == "summary_json");
  for (const std::string& folder : all) CHECK(folder.find('/') == std::string::npos);
}

TEST_CASE("Names with quotes do not end the cell of a table that they are in") {
  RecordingWriter writer(test::small_head());
  writer.add(joins(3, "a\",joined,\"b", Micros{5'000'000}));
  writer.finish();
  const auto bytes = writer.take();
  const RecordingReader recording(bytes, "some.rec");
  const ExportFolder out;
  export_csv(recording, out.path);
  CHECK(out.text("events.csv").find("\"a\"\",joined,\"\"b\"") != std::string::npos);
}

TEST_CASE("Names that a spreadsheet would take for formulas are texts in tables") {
  RecordingWriter writer(test::small_head());
  for (const char* name : {"=cmd|'/c'!A1", "+1", "-1", "@a", "a=1"}) writer.add(joins(3, name, Micros{5'000'000}));
  writer.finish();
  const auto bytes = writer.take();
  const ExportFolder out;
  export_csv(RecordingReader(bytes, "some.rec"), out.path);
  for (const char* cell : {"\"'=cmd|'/c'!A1\"", "\"'+1\"", "\"'-1\"", "\"'@a\"", "\"a=1\""})
    CHECK(out.text("events.csv").find(cell) != std::string::npos);
}

TEST_CASE("The holds of a recording are exported with the names of both stations and their forces") {
  RecordingWriter writer(test::small_head());
  writer.add(joins(3, "OR 3", test::kSmallBegin));
  writer.add(joins(4, "trainee", test::kSmallBegin));
  writer.add(RecordedGuidance{test::kSmallBegin + Micros{250'000}, 3, 4, 1.5, 2.25});
  writer.finish();
  const auto bytes = writer.take();
  const RecordingReader recording(bytes, "some.rec");
  const ExportFolder out;
  export_csv(recording, out.path);
  CHECK(out.text("guidance.csv") == "t_s,guide,guided,guide_force_n,guided_force_n\n0.250000,\"OR 3\",\"trainee\",1.5,2.25\n");
}

TEST_CASE("A recording with one time far from the others exports the shapes that there are, and no more") {
  const Micros far{9'000'000'000'000};
  RecordingWriter writer(test::small_head());
  for (int k = 0; k < 20; ++k) writer.add_shape(test::kSmallBegin + k * Micros{100'000}, test::small_shape(k));
  writer.add(joins(3, "hand", far));
  writer.add_shape(far + Micros{60'000'000}, test::small_shape(20));
  writer.finish();
  const auto bytes = writer.take();
  RecordingReader recording(bytes, "some.rec");
  const ExportFolder out;
  const std::size_t shapes = export_shapes(recording, out.path, ShapeFormat::ply, 10);
  CHECK(shapes >= 20);
  CHECK(shapes <= 20 + 25);  // each end of a recorded part stands for two seconds
}
