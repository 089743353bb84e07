#include "bench/lab/session_csv.hpp"

#include <fmt/format.h>
#include <fmt/ostream.h>

#include <algorithm>
#include <cctype>
#include <fstream>
#include <map>
#include <utility>

#include "common/assessment/task_attempts.hpp"
#include "common/base/error.hpp"
#include "common/io/record_file.hpp"
#include "common/wire/codec.hpp"

namespace palpate {
namespace {

/// Escapes a text for double quotes. What a spreadsheet would take for a formula gets an apostrophe in front, as others wrote it.
std::string in_table(std::string text) {
  if (!text.empty() && std::string_view("=+-@").find(text.front()) != std::string_view::npos) text.insert(0, 1, '\'');
  for (std::size_t at = 0; (at = text.find('"', at)) != std::string::npos; at += 2) text.insert(at, 1, '"');
  return text;
}

/// CSV files by path; each is created with its header at its first row.
class Tables {
 public:
  explicit Tables(const std::filesystem::path& out) : out_(out) {}

  template <class... Values>
  void row(const std::filesystem::path& file, const char* header, const char* format, const Values&... values) {
    auto found = files_.find(file);
    if (found == files_.end()) found = files_.emplace(file, begin(file, header)).first;
    found->second << fmt::format(fmt::runtime(format), values...) << '\n';
    ++rows_;
  }
  std::size_t close() {
    for (auto& [path, file] : files_) {
      file.close();
      if (!file) throw InputError((out_ / path).string(), "cannot be written", "room on the disk and the right to write");
    }
    return rows_;
  }

 private:
  std::ofstream begin(const std::filesystem::path& file, const char* header) {
    std::error_code ignored;
    std::filesystem::create_directories((out_ / file).parent_path(), ignored);
    std::ofstream stream(out_ / file, std::ios::binary);
    stream << header << '\n';
    return stream;
  }

  std::filesystem::path out_;
  std::map<std::filesystem::path, std::ofstream> files_;
  std::size_t rows_ = 0;
};

class Exporter {
 public:
  Exporter(const RecordingReader& recording, const std::filesystem::path& out) : recording_(recording), tables_(out) {}

  void add(const RecordedBlock& block) {
    for (const RecordedEvent& event : block.events) add(event);
    for (const RecordedFrame& frame : block.frames) add(frame);
    for (const RecordedPath& path : block.paths)
      for (const ToolSample& sample : path.samples) add_sample(name_of(path.station), sample.t, sample.position);
    for (const RecordedTouch& touch : block.touches) add(touch);
    for (const RecordedTick& tick : block.ticks) add(tick);
    for (const RecordedHandOver& swap : block.hand_overs)
      tables_.row(folder(recording_.head().name) / "hand_overs.csv", "t_s,stamp_s,step_n", "{:.6f},{:.6f},{:.9g}", t_s(swap.t),
                  t_s(swap.stamp), swap.step_n);
    for (const RecordedPacket& packet : block.packets) add(packet);
    for (const RecordedLink& link : block.links) add(link);
    for (const RecordedNote& note : block.notes)
      tables_.row("notes.csv", "t_s,written_s,author,text", "{:.6f},{:.6f},\"{}\",\"{}\"", t_s(note.about), t_s(note.t),
                  in_table(note.author), in_table(note.text));
    for (const RecordedGuidance& g : block.guidances)
      tables_.row("guidance.csv", "t_s,guide,guided,guide_force_n,guided_force_n", "{:.6f},\"{}\",\"{}\",{:.9g},{:.9g}", t_s(g.t),
                  in_table(name_of(g.guide)), in_table(name_of(g.guided)), g.guide_force_n, g.guided_force_n);
    for (const RecordedTurn& turn : block.turns) add(turn);
    for (const RecordedButtons& change : block.buttons) add(change);
  }
  void add(const TaskAttempt& a) {
    const TaskProgress& p = a.progress;
    const auto& goal = recording_.head().task->goal;
    const bool presses = std::holds_alternative<PressTask>(goal), traces = std::holds_alternative<TraceTask>(goal);
    const auto cell = [](bool applies, const char* format, double value) {
      return applies ? fmt::format(fmt::runtime(format), value) : std::string();
    };
    const Vec3 mark = p.mark.value_or(Vec3::Zero());
    const auto mark_cell = [&](Eigen::Index k) { return cell(p.mark.has_value(), "{:.9f}", mark[k]); };
    tables_.row(
        "tasks.csv",
        "station,attempt,begin_s,task,score,done,time_s,force_max_n,held_s,traced_m,within,miss_m,mark_x_m,mark_y_m,mark_z_m",
        "\"{}\",{},{:.6f},{},{:.2f},{:.4f},{:.3f},{:.6g},{},{},{},{},{},{},{}", in_table(a.station), a.number, a.begin_s,
        kind_of(*recording_.head().task), p.score, p.done, p.time_s, p.force_max_n, cell(presses, "{:.3f}", p.held_s),
        cell(traces, "{:.6f}", p.traced_m), cell(traces, "{:.4f}", p.within), cell(p.mark.has_value(), "{:.6f}", p.miss_m),
        mark_cell(0), mark_cell(1), mark_cell(2));
  }
  std::size_t close() { return tables_.close(); }
  const StationFolders& folders() const { return folders_; }

 private:
  double t_s(Micros t) const { return seconds(t - recording_.begin()); }
  /// A station's recording contains no other station.
  std::string name_of(StationId id) const {
    return recording_.head().kind == RecordingKind::station ? recording_.head().name : recording_.name_of(id);
  }
  std::filesystem::path folder(const std::string& name) { return folders_.of(name); }
  static double ms(Micros t) { return 1e3 * seconds(t); }

  void add(const RecordedEvent& e) {
    const std::string name =
        e.station == 0 && e.name.empty() && recording_.head().kind == RecordingKind::station ? name_of(0) : e.name;
    tables_.row("events.csv", "t_s,event,station,scheme,text,tool", "{:.6f},{},\"{}\",{},\"{}\",\"{}\"", t_s(e.t),
                palpate::name_of(e.kind), in_table(name),
                e.kind == RecordedEventKind::joined && e.station != 0 ? palpate::name_of(e.scheme) : "", in_table(e.text),
                in_table(e.tool.name));
  }
  void add(const RecordedFrame& f) {
    tables_.row("frames.csv", "t_s,took_ms,behind_ms,steps,cut_steps,newton_iterations,skipped,failed",
                "{:.6f},{:.3f},{:.3f},{},{},{},{},{:d}", t_s(f.t), ms(f.took), ms(f.behind), f.steps, f.cut_steps,
                f.newton_iterations, f.skipped, f.failed);
  }
  void add_sample(const std::string& station, Micros t, const Vec3& x) {
    tables_.row(folder(station) / "samples.csv", "t_s,x_m,y_m,z_m", "{:.6f},{:.9f},{:.9f},{:.9f}", t_s(t), x.x(), x.y(), x.z());
  }
  void add(const RecordedTouch& t) {
    const auto to = folder(name_of(t.station));
    tables_.row(to / "forces.csv", "t_s,fx_n,fy_n,fz_n,contact,x_m,y_m,z_m",
                "{:.6f},{:.9g},{:.9g},{:.9g},{:d},{:.9f},{:.9f},{:.9f}", t_s(t.t), t.force.x(), t.force.y(), t.force.z(),
                t.contact, t.tool.x(), t.tool.y(), t.tool.z());
    if (!t.torque.isZero(0))
      tables_.row(to / "torques.csv", "t_s,tx_nm,ty_nm,tz_nm", "{:.6f},{:.9g},{:.9g},{:.9g}", t_s(t.t), t.torque.x(),
                  t.torque.y(), t.torque.z());
    if (t.has_patch)
      tables_.row(to / "patches.csv", "stamp_s,scheme,states,bytes,bridge_ms", "{:.6f},{},{},{},{:.3f}", t_s(t.t),
                  palpate::name_of(t.scheme), t.states, t.bytes, ms(t.horizon));
  }
  void add(const RecordedTick& t) {
    const std::string& name = recording_.head().name;
    add_sample(name, t.t, t.position);
    tables_.row(folder(name) / "forces.csv", "t_s,fx_n,fy_n,fz_n,contact,fx_model_n,fy_model_n,fz_model_n,patch_age_ms",
                "{:.6f},{:.9g},{:.9g},{:.9g},{:d},{:.9g},{:.9g},{:.9g},{:.3f}", t_s(t.t), t.force.x(), t.force.y(), t.force.z(),
                t.contact, t.model_force.x(), t.model_force.y(), t.model_force.z(), t.has_patch ? ms(t.patch_age) : -1.0);
    if (t.torque.isZero(0) && t.model_torque.isZero(0)) return;
    tables_.row(folder(name) / "torques.csv", "t_s,tx_nm,ty_nm,tz_nm,tx_model_nm,ty_model_nm,tz_model_nm",
                "{:.6f},{:.9g},{:.9g},{:.9g},{:.9g},{:.9g},{:.9g}", t_s(t.t), t.torque.x(), t.torque.y(), t.torque.z(),
                t.model_torque.x(), t.model_torque.y(), t.model_torque.z());
  }
  void add(const RecordedPacket& packet) {
    Message message;
    const auto fault = decode(packet.bytes, message);
    const auto* patch = fault == WireFault::none ? std::get_if<PatchMessage>(&message.body) : nullptr;
    const bool terms = fault == WireFault::none && std::holds_alternative<PatchTerms>(message.body);
    tables_.row(folder(recording_.head().name) / "patches.csv", "t_s,stamp_s,scheme,states,bytes,what",
                "{:.6f},{:.6f},{},{},{},{}", t_s(packet.t), patch ? t_s(patch->patch.stamp) : 0.0,
                patch ? palpate::name_of(patch->patch.scheme) : "", patch ? patch->patch.states() : 0, packet.bytes.size(),
                patch   ? "patch"
                : terms ? "terms"
                        : describe(fault));
  }
  void add(const RecordedLink& l) {
    tables_.row(folder(name_of(l.station)) / "links.csv", "t_s,rtt_ms,rtt_min_ms,jitter_ms,patch_age_ms,offset_ms,received,lost",
                "{:.6f},{:.3f},{:.3f},{:.3f},{:.3f},{:.3f},{},{}", t_s(l.t), ms(l.rtt), ms(l.rtt_min), ms(l.jitter),
                ms(l.patch_age), ms(l.offset), l.received, l.lost);
  }

  // Blocks repeat at their beginning the last values of the block before.
  void add(const RecordedTurn& t) {
    const Eigen::Vector4d q = t.orientation.coeffs();
    const std::pair<Eigen::Vector4d, double> held{q, t.opening};
    const auto [at, first] = turns_.try_emplace(t.station, held);
    if (!first && std::exchange(at->second, held) == held) return;
    tables_.row(folder(name_of(t.station)) / "orientation.csv", "t_s,qx,qy,qz,qw,opening",
                "{:.6f},{:.6f},{:.6f},{:.6f},{:.6f},{:.6f}", t_s(t.t), q.x(), q.y(), q.z(), q.w(), t.opening);
  }
  void add(const RecordedButtons& b) {
    if (b.pressed == std::exchange(buttons_[b.station], b.pressed)) return;
    tables_.row(folder(name_of(b.station)) / "buttons.csv", "t_s,buttons", "{:.6f},{}", t_s(b.t), b.pressed);
  }

  const RecordingReader& recording_;
  StationFolders folders_;
  Tables tables_;
  std::map<StationId, std::pair<Eigen::Vector4d, double>> turns_;
  std::map<StationId, std::uint32_t> buttons_;
};

}  // namespace

const std::string& StationFolders::of(const std::string& station) {
  const auto [at, fresh] = folders_.try_emplace(station);
  if (!fresh) return at->second;
  std::string plain = plain_name(station);
  std::replace(plain.begin(), plain.end(), '.', '_');
  const auto lower = [](std::string name) {
    for (char& c : name) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    return name;
  };
  std::string folder = plain;
  for (int number = 2; !taken_.insert(lower(folder)).second; ++number) folder = fmt::format("{}-{}", plain, number);
  return at->second = folder;
}

CsvExport export_csv(const RecordingReader& recording, const std::filesystem::path& out) {
  CsvExport done;
  Exporter exporter(recording, out);
  for (std::size_t k = 0; k < recording.blocks().size(); ++k) {
    const auto block = recording.read(k);
    if (block)
      exporter.add(*block);
    else
      ++done.blocks_lost;
  }
  for (const TaskAttempt& attempt : task_attempts(recording)) exporter.add(attempt);
  done.rows = exporter.close();
  done.folders = exporter.folders();
  return done;
}

}  // namespace palpate
