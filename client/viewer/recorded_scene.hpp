// A room's recording for the viewer: shapes and tools of any moment, and the figures for the panels.
//
// Opening reads through the recording once and keeps everything but the shapes, which stay in the file and are read when shown.
// Between two recorded shapes the vertices move linearly; the writer omits a shape that equals the last one, so the motion
// towards a shape begins one period of the shapes before it. Tools move linearly between two frames. Both depend on the moment
// alone: a moment looks the same however it was reached. Where a blade cuts the body, the surface changes with the shape at which
// it did.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "client/viewer/history.hpp"
#include "client/viewer/view_core.hpp"
#include "common/record/reader.hpp"

namespace palpate {

class RecordedScene {
 public:
  static constexpr std::size_t kCourseParts = 400;
  static constexpr std::size_t kTaskFrames = 100;  ///< frames between two moments at which the task's progress is kept

  /// `recording` outlives it; `name` stands for the file in errors. Throws InputError when there is no body to draw: a station's
  /// recording, a body without triangles, a recording without shapes.
  RecordedScene(const RecordingReader& recording, const std::string& name);

  /// Surface of the moment that at() returned last, and its vertices at rest; before, that of the first.
  const BodyMesh& mesh() const { return mesh_; }
  const std::vector<Eigen::Vector3f>& rest() const { return rest_; }
  const std::vector<BodyName>& bodies() const { return recording_.head().bodies; }
  const std::vector<PartMesh>& parts() const { return recording_.head().parts; }
  /// Number of that surface, from 1 on: a blade makes another.
  std::uint32_t mesh_version() const { return mesh_number_ + 1; }
  /// Ends of the recording; before its first shape the first one is shown.
  Micros begin() const { return recording_.begin(); }
  Micros end() const { return recording_.end(); }
  /// Time between two frames.
  Micros period() const { return period_; }
  /// Number of unreadable blocks; their contents are missing.
  std::size_t damaged_blocks() const { return damaged_; }

  /// Returns shape and tools at t, in [begin, end].
  ViewMoment at(Micros t);
  /// Returns links, schemes and costs as of t, over the last second of frames; losses over the last ten.
  RoomView room_at(Micros t) const;
  /// Returns the training task and the progress of every hand in the attempt of moment t, by the frames up to then.
  TaskWatch task_at(Micros t) const;
  /// Notes, by the moments that they are about.
  const std::vector<RecordedNote>& notes() const { return notes_; }
  /// Fills the plots as they would be after watching up to t.
  void plot(Micros t, History& forces, History& patch_ages) const;

  /// Returns the names of the hands with a tool, in order of arrival.
  std::vector<std::string> hands() const;
  float displacement_max_m() const { return displacement_max_m_; }
  float force_max_n() const { return force_max_n_; }
  /// The largest force on any tool in each of kCourseParts equal parts of the time, as shares of the largest of all.
  const std::vector<float>& course() const { return course_; }

 private:
  struct ShapePlace {
    Micros t;
    std::size_t block, place;
    std::uint32_t mesh;
  };
  struct Frame {
    Micros t, took;
  };
  struct Hand {
    std::string name;
    RecordedRole role = RecordedRole::hand;
    Scheme scheme = Scheme::port;
    HeldTool tool;
    Micros joined{}, gone = Micros::max();
    std::vector<RecordedTouch> touches;
    std::vector<RecordedLink> links;
    std::vector<RecordedTurn> turns;
    std::vector<RecordedButtons> buttons;
    std::vector<RecordedGuidance> guidances;  ///< those in which it guides
  };

  void take(const RecordedBlock& block, std::size_t k);
  void take_events(const RecordedBlock& block);
  static void hold_at(const Hand& hand, Micros t, ToolView& tool);
  void note_displacement(const RecordedShape& shape);
  void make_course();
  void make_task();
  void watch_frames(std::size_t from, std::size_t to, TaskWatch& watch) const;
  const std::vector<Vec3>& positions(std::size_t shape);
  void show_mesh(const BodyMesh& mesh, std::uint32_t number);
  void shape_at(Micros t, Shape& shape);
  std::vector<ToolView> tools_at(Micros t) const;
  StationView station_at(const Hand& hand, Micros t) const;

  const RecordingReader& recording_;
  RecordedSurfaces surfaces_;
  BodyMesh mesh_;
  std::uint32_t mesh_number_ = 0;
  std::vector<Eigen::Vector3f> rest_;
  std::vector<ShapePlace> shapes_;
  std::vector<Frame> frames_;
  std::map<StationId, Hand> hands_;
  std::vector<float> course_;
  std::vector<RecordedNote> notes_;
  std::vector<Micros> resets_;
  std::vector<TaskWatch> tasks_;               ///< before frames 0, kTaskFrames, ...; empty without a task
  std::map<std::size_t, RecordedBlock> read_;  ///< blocks of the shapes around the moment shown last
  Micros period_{50'000}, shape_period_{100'000};
  std::size_t damaged_ = 0;
  float displacement_max_m_ = 0, force_max_n_ = 0;
};

}  // namespace palpate
