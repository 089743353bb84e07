// Arrays of numpy over memory of C++, and back, without copies.
#pragma once

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>

#include <span>
#include <vector>

#include "common/base/error.hpp"
#include "common/base/types.hpp"

namespace palpate::python {

namespace py = pybind11;

/// Read-only array of `shape` over memory that `owner` keeps; `strides` in bytes.
template <class Number>
py::array view(const Number* data, std::vector<py::ssize_t> shape, std::vector<py::ssize_t> strides, py::handle owner) {
  py::array array(py::dtype::of<Number>(), std::move(shape), std::move(strides), data, owner);
  py::detail::array_proxy(array.ptr())->flags &= ~py::detail::npy_api::NPY_ARRAY_WRITEABLE_;
  return array;
}

/// Member of every item of a range, as an array of one number an item.
template <class Item, class Number>
py::array column(std::span<const Item> items, Number Item::*member, py::handle owner) {
  const Number* first = items.empty() ? nullptr : &(items.front().*member);
  return view(first, {static_cast<py::ssize_t>(items.size())}, {sizeof(Item)}, owner);
}

/// The same for a vector: an array of n x 3 numbers.
template <class Item>
py::array column(std::span<const Item> items, Vec3 Item::*member, py::handle owner) {
  const double* first = items.empty() ? nullptr : (items.front().*member).data();
  return view(first, {static_cast<py::ssize_t>(items.size()), 3}, {sizeof(Item), sizeof(double)}, owner);
}

/// Vectors as an array of n x 3 numbers.
template <class Vector3>
py::array rows(std::span<const Vector3> items, py::handle owner) {
  return view(items.empty() ? nullptr : items.front().data(), {static_cast<py::ssize_t>(items.size()), 3},
              {sizeof(Vector3), sizeof(typename Vector3::Scalar)}, owner);
}

/// A dense matrix as an array of two dimensions, in its own order of storage.
template <class Matrix>
py::array matrix(const Matrix& m, py::handle owner) {
  constexpr auto size = static_cast<py::ssize_t>(sizeof(typename Matrix::Scalar));
  return view(m.data(), {m.rows(), m.cols()}, {m.rowStride() * size, m.colStride() * size}, owner);
}

/// A vector as an array of one dimension.
template <class Vector>
py::array vector(const Vector& v, py::handle owner) {
  return view(v.data(), {v.size()}, {sizeof(typename Vector::Scalar)}, owner);
}

/// Positions as Python passes them: n x 3 doubles in one block; other arrays are converted once.
using Positions = py::array_t<double, py::array::c_style | py::array::forcecast>;

inline std::string shape_of(const Positions& array) {
  std::string shape;
  for (py::ssize_t k = 0; k < array.ndim(); ++k) shape += (k == 0 ? "" : ", ") + std::to_string(array.shape(k));
  return "has the shape (" + shape + ")";
}

/// Throws InputError, with `where`, unless the array is n x 3.
inline std::span<const Vec3> positions_of(const Positions& array, const std::string& where) {
  static_assert(sizeof(Vec3) == 3 * sizeof(double));
  if (array.ndim() != 2 || array.shape(1) != 3) throw InputError(where, shape_of(array), "an array of the shape (n, 3) [m]");
  return {reinterpret_cast<const Vec3*>(array.data()), static_cast<std::size_t>(array.shape(0))};
}

/// A pose of three columns, a position; of seven, with the orientation x, y, z, w of a quaternion; of eight, with the opening of
/// jaws.
inline constexpr py::ssize_t kPoseColumns = 8;
inline constexpr bool is_pose(py::ssize_t columns) { return columns == 3 || columns == 7 || columns == kPoseColumns; }
inline ToolSample pose_at(const double* row, py::ssize_t columns) {
  ToolSample pose{.position = {row[0], row[1], row[2]}};
  if (columns > 3) pose.orientation = Rotation(row[6], row[3], row[4], row[5]);
  if (columns > 7) pose.opening = row[7];
  return pose;
}

/// Throws InputError, with `where`, unless the array is n x 3, 7 or 8; its numbers are not checked.
inline std::vector<ToolSample> poses_of(const Positions& array, const std::string& where) {
  if (array.ndim() != 2 || !is_pose(array.shape(1)))
    throw InputError(where, shape_of(array),
                     "(n, 3) [m], (n, 7) with an orientation x, y, z, w, or (n, 8) with an opening as well");
  const py::ssize_t columns = array.shape(1);
  std::vector<ToolSample> poses;
  for (py::ssize_t k = 0; k < array.shape(0); ++k) poses.push_back(pose_at(array.data() + k * columns, columns));
  return poses;
}

/// One pose.
inline ToolSample pose_of(const Positions& array, const std::string& where) {
  if (array.ndim() != 1 || !is_pose(array.shape(0)))
    throw InputError(where, shape_of(array), "3 numbers, 7 with an orientation x, y, z, w, or 8 with an opening as well");
  return pose_at(array.data(), array.shape(0));
}

/// An orientation as an array of x, y, z, w.
inline py::array quaternion(const Rotation& turn, py::handle owner) { return vector(turn.coeffs(), owner); }

/// One vector: three doubles.
inline Vec3 position_of(const Positions& array, const std::string& where) {
  if (array.ndim() != 1 || array.shape(0) != 3) throw InputError(where, "is no vector", "three numbers");
  return {array.data()[0], array.data()[1], array.data()[2]};
}

}  // namespace palpate::python
