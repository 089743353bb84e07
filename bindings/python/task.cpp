// TaskScorer: the score of a hand in the training task of a scene (common/task/score.hpp).
#include "common/task/score.hpp"

#include <memory>

#include "bindings/python/arrays.hpp"
#include "bindings/python/module.hpp"
#include "common/base/error.hpp"
#include "server/scene/scene.hpp"

namespace palpate::python {
namespace {

/// A scorer with the task that it needs in place.
class OwnedScorer {
 public:
  explicit OwnedScorer(const Scene& scene) {
    if (!scene.task) throw InputError("scene \"" + scene.name + "\"", "has no task", "one with a task");
    task_ = std::make_unique<const Task>(*scene.task);
    scorer_ = std::make_unique<TaskScorer>(*task_);
  }
  const Task& task() const { return *task_; }
  TaskScorer& scorer() { return *scorer_; }
  const TaskProgress& progress() const { return scorer_->progress(); }

 private:
  std::unique_ptr<const Task> task_;
  std::unique_ptr<TaskScorer> scorer_;
};

}  // namespace

void add_task(py::module_& module) {
  py::class_<OwnedScorer>(module, "TaskScorer",
                          "Judges one hand in one attempt at the training task of a scene, by the rule that viewers and\n"
                          "palpate-lab summary use (docs/reference/scenes.md). Raises InputError for a scene without a task.")
      .def(py::init<const Scene&>(), py::arg("scene"))
      .def(
          "add",
          [](OwnedScorer& self, double t_s, const Positions& position, const Positions& force, bool contact,
             std::uint32_t buttons) {
            self.scorer().add({t_s, position_of(position, "position"), position_of(force, "force"), contact, buttons});
          },
          py::arg("t_s"), py::arg("position"), py::arg("force"), py::arg("contact"), py::arg("buttons") = 0,
          "Adds the tool at a time [s], ascending: position (3,) [m], force on it (3,) [N], and the buttons that were down "
          "since\n"
          "the last time (bit n: button n).")
      .def_property_readonly(
          "kind", [](const OwnedScorer& self) { return kind_of(self.task()); }, "\"find\", \"press\" or \"trace\".")
      .def_property_readonly(
          "text", [](const OwnedScorer& self) { return self.task().text; }, "The goal, in one line.")
      .def_property_readonly(
          "score", [](const OwnedScorer& self) { return self.progress().score; }, "0 to 100, if the attempt ended now.")
      .def_property_readonly(
          "done", [](const OwnedScorer& self) { return self.progress().done; },
          "Share of the task that is done; 1: it has ended.")
      .def("__repr__",
           [](const OwnedScorer& self) { return "<palpate.TaskScorer, " + in_words(self.task(), self.progress()) + ">"; });
}

}  // namespace palpate::python
