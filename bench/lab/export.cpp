// palpate-lab export: a recording as files for other programs.
#include <fmt/format.h>

#include "bench/lab/experiments.hpp"
#include "bench/lab/flags.hpp"
#include "bench/lab/session_csv.hpp"
#include "bench/lab/session_shapes.hpp"
#include "bench/output/output.hpp"
#include "common/base/counted.hpp"
#include "common/base/limits.hpp"
#include "common/io/mapped_file.hpp"

namespace palpate {
namespace {

struct ExportFlags {
  std::string recording, out;
  double frames_hz = 0;
  ShapeFormat format = ShapeFormat::vtk;
};

int run_export(const ExportFlags& flags) {
  const std::string where = "--recording " + flags.recording;
  const MappedFile file(flags.recording);
  RecordingReader recording(file.bytes(), where);
  const auto out = make_output_folder(flags.out);
  if (!recording.complete()) fmt::print(stderr, "{}: {}; what can be read is exported\n", where, recording.damage());
  const CsvExport csv = export_csv(recording, out);
  if (csv.blocks_lost > 0)
    fmt::print(stderr, "{}: left out {} that {} damaged\n", where, counted(csv.blocks_lost, "block"),
               csv.blocks_lost == 1 ? "is" : "are");
  const RecordingHead& head = recording.head();
  const double hz = flags.frames_hz > 0 ? flags.frames_hz : head.shapes_hz;
  const std::size_t shapes = hz > 0 && !head.surface.nodes.empty() ? export_shapes(recording, out, flags.format, hz) : 0;
  fmt::print("{} \"{}\", {:.1f} s, ends at {:.6f} s of the clock: {}, {} in {}\n",
             head.kind == RecordingKind::room ? "room" : "station", head.name, seconds(recording.end() - recording.begin()),
             seconds(recording.end()), counted(csv.rows, "row"), counted(shapes, "shape"), out.string());
  return 0;
}

}  // namespace

void add_export(CLI::App& app, Run& run) {
  auto flags = std::make_shared<ExportFlags>();
  CLI::App* c = app.add_subcommand("export", "export a recorded session as CSV, and its shapes as PLY or VTK");
  c->add_option("--recording", flags->recording, "file written by palpate-server or palpate-client with --record")
      ->type_name("FILE")
      ->required();
  c->add_option("--frames-hz", flags->frames_hz, "shapes per second; default: as recorded")
      ->check(number_from<double>(0.001, kMaxRateHz));
  c->add_option("--format", flags->format, "format of the shapes: vtk (for ParaView) or ply")
      ->transform(one_of_names<ShapeFormat>({{"ply", ShapeFormat::ply}, {"vtk", ShapeFormat::vtk}}))
      ->default_str("vtk");
  c->add_option("--out", flags->out, "folder for the files")->type_name("DIR")->required();
  c->callback([flags, &run] { run = [flags] { return run_export(*flags); }; });
}

}  // namespace palpate
