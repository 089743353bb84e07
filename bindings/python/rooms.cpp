// Rooms: several bodies with one tool each, stepped together (bindings/core/local_rooms.hpp).
#include "bindings/core/local_rooms.hpp"

#include <algorithm>
#include <memory>

#include "bindings/python/arrays.hpp"
#include "bindings/python/module.hpp"
#include "common/io/spinning_thread_pool.hpp"

namespace palpate::python {
namespace {

constexpr std::size_t kMostRooms = 4096, kMostThreads = 256;

/// Rooms with the threads that step them.
class PooledRooms {
 public:
  PooledRooms(const Scene& scene, std::size_t count, std::size_t threads)
      : pool_(std::min(count, threads > 0 ? threads : SpinningThreadPool::processors())), rooms_(scene, count, pool_) {}

  LocalRooms& rooms() { return rooms_; }
  std::size_t threads() const { return pool_.size(); }

 private:
  SpinningThreadPool pool_;
  LocalRooms rooms_;
};

std::unique_ptr<PooledRooms> make_rooms(const Scene& scene, std::size_t count, std::size_t threads) {
  if (count < 1 || count > kMostRooms)
    throw InputError("count", "is " + std::to_string(count), "1 to " + std::to_string(kMostRooms));
  if (threads > kMostThreads)
    throw InputError("threads", "is " + std::to_string(threads), "0 (one a processor) to " + std::to_string(kMostThreads));
  const py::gil_scoped_release others_run;
  return std::make_unique<PooledRooms>(scene, count, threads);
}

std::span<const Vec3> one_each(const Positions& array, const std::string& where, std::size_t rooms) {
  const auto items = positions_of(array, where);
  if (items.size() != rooms)
    throw InputError(where, "has " + std::to_string(items.size()) + " rows",
                     "one for each of " + std::to_string(rooms) + " rooms");
  return items;
}

py::tuple step_rooms(PooledRooms& self, const Positions& from, const Positions& by, std::size_t ticks) {
  const std::size_t n = self.rooms().size();
  const std::span<const Vec3> starts = one_each(from, "positions", n), ways = one_each(by, "by", n);
  std::vector<LocalRoomsTool> tools(n);
  {
    const py::gil_scoped_release others_run;
    self.rooms().step(starts, ways, ticks, tools);
  }
  py::array_t<double> forces({static_cast<py::ssize_t>(n), py::ssize_t{3}});
  py::array_t<bool> contact(static_cast<py::ssize_t>(n)), failed(static_cast<py::ssize_t>(n));
  for (std::size_t k = 0; k < n; ++k) {
    std::copy_n(tools[k].force.data(), 3, forces.mutable_data(static_cast<py::ssize_t>(k)));
    contact.mutable_data()[k] = tools[k].contact;
    failed.mutable_data()[k] = tools[k].failed;
  }
  return py::make_tuple(forces, contact, failed);
}

void renew_room(PooledRooms& self, std::size_t k, const Scene* scene) {
  if (k >= self.rooms().size())
    throw InputError("room " + std::to_string(k), "is not there", "0 to " + std::to_string(self.rooms().size() - 1));
  const py::gil_scoped_release others_run;
  if (scene == nullptr)
    self.rooms().renew(k);
  else
    self.rooms().renew(k, *scene);
}

}  // namespace

void add_rooms(py::module_& module) {
  py::class_<PooledRooms>(
      module, "Rooms",
      "Several bodies with one tool each, in this process, stepped together by threads of their own.\n\n"
      "Rooms(scene, count, threads=0) has count bodies at rest; threads=0: one a processor. Each room has the\n"
      "bits of a Room alone, whatever the number of threads. One caller at a time, but for renew() of different rooms.")
      .def(py::init(&make_rooms), py::arg("scene"), py::arg("count"), py::arg("threads") = 0)
      .def("__len__", [](PooledRooms& self) { return self.rooms().size(); })
      .def_property_readonly("threads", &PooledRooms::threads, "Number of threads that step the bodies, the caller's included.")
      .def("renew", &renew_room, py::arg("room"), py::arg("scene") = py::none(),
           "Replaces a room by a body at rest, of its own scene or of another one. The first takes less time.")
      .def("step", &step_rooms, py::arg("positions"), py::arg("by"), py::arg("ticks"),
           "Moves every tool by `by`, (rooms, 3) [m], from `positions`, (rooms, 3) [m], on a straight line in ticks ms (1 to "
           "1000),\n"
           "and the bodies with them. Returns forces of the full model on the tools at the end, (rooms, 3) [N], contact, "
           "(rooms,),\n"
           "and failed, (rooms,). The interpreter's lock is released once. Raises InputError for arrays of other shapes and\n"
           "positions that are not finite or beyond 10 m, before anything moves.");
}

}  // namespace palpate::python
