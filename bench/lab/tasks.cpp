#include "bench/lab/tasks.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "bench/fidelity/replay.hpp"
#include "bench/lab/parallel.hpp"
#include "bench/measure/examination.hpp"
#include "common/base/error.hpp"
#include "server/body/unload.hpp"

namespace palpate {

std::vector<std::string> scenes_in(const std::filesystem::path& folder, const std::vector<std::string>& only) {
  std::vector<std::string> names;
  if (std::filesystem::is_directory(folder))
    for (const auto& entry : std::filesystem::directory_iterator(folder))
      if (entry.path().extension() == ".json") names.push_back(entry.path().stem().string());
  if (names.empty()) throw InputError("--scenes " + folder.string(), "holds no scene", "a folder of *.json");
  std::sort(names.begin(), names.end());
  for (const std::string& name : only)
    if (!std::filesystem::exists(folder / (name + ".json")))
      throw InputError("--only " + name, "is no scene of " + folder.string(), fmt::format("one of {}", fmt::join(names, ", ")));
  return only.empty() ? names : only;
}

std::string at_place(const std::string& scene, int place) { return place == 0 ? scene : fmt::format("{}@{}", scene, place); }

void add_examination(SweepTasks& tasks, const std::filesystem::path& scenes, const std::string& name, bool fast) {
  if (tasks.contains(name)) return;
  const auto at = name.rfind('@');
  const int place = at == std::string::npos ? 0 : std::stoi(name.substr(at + 1));
  Scene body = open_scene((scenes / (name.substr(0, at) + ".json")).string());
  const ExaminedPlace examined = place == 0 ? top_of(body) : drawn_places(body, place).back();
  Motion motion = fast ? fast_strokes(body, examined) : examination(body, examined);
  tasks.emplace(name, SweepTask{std::move(body), std::move(motion), {}});
}

void add_references(SweepTasks& tasks, unsigned jobs) {
  std::vector<SweepTask*> list;
  for (auto& [name, task] : tasks) list.push_back(&task);
  run_all(
      list.size(), [&](std::size_t i) { list[i]->reference = reference_of(list[i]->scene, list[i]->motion); }, jobs,
      "the references");
}

}  // namespace palpate
