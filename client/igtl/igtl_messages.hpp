// Messages of OpenIGTLink, protocol version 2 (openigtlink.org): the bytes of those that a simulation and 3D Slicer exchange.
//
//     header   version u16, type 12 bytes, device name 20 bytes, time stamp u64 (32.32 s since 1970), size of the body u64,
//     CRC-64 u64 body     TRANSFORM  nine float32 of the rotation, column by column, then three of the translation
//              SENSOR     length u8, status u8, unit u64, float64 values
//              POLYDATA   ten counts u32, points as three float32, cells as (n, i1 .. in) of u32, attributes
//
// All numbers are big-endian. Lengths are millimetres in RAS, the patient's frame: x to the right, y anterior, z superior. The
// CRC has the polynomial of ECMA-182 and covers the body. Names are cut to 20 bytes.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "client/viewer/surface.hpp"

namespace palpate {

/// CRC-64 of ECMA-182, most significant bit first, from 0.
std::uint64_t igtl_crc(std::string_view bytes);

/// Returns a TRANSFORM: `rotation` has the tool's axes as columns.
std::string igtl_transform(std::string_view name, const Mat3& rotation, const Vec3& position_mm, std::uint64_t stamp);
/// Returns a SENSOR with the three components of a force [N], RAS.
std::string igtl_force(std::string_view name, const Vec3& force_n, std::uint64_t stamp);
/// Returns a POLYDATA with the attribute `scalar_name` of each point, one number a point.
std::string igtl_polydata(std::string_view name, std::span<const Vec3f> points_mm, std::span<const Triangle> triangles,
                          std::string_view scalar_name, std::span<const float> scalars, std::uint64_t stamp);

/// A message of which the body is complete and has the right CRC, without the extended header and the metadata of version 3.
struct IgtlMessage {
  std::string type, name;
  std::string content;  ///< empty for another type than POLYDATA
};

/// Cuts a stream of bytes into messages.
class IgtlReader {
 public:
  static constexpr std::uint64_t kBodyBytesMost = std::uint64_t{64} << 20;

  void add(std::string_view bytes) { bytes_ += bytes; }
  /// Returns the next complete message. Throws InputError for bytes that are no OpenIGTLink; nothing can be read then any more.
  std::optional<IgtlMessage> next();

 private:
  std::string bytes_;
};

/// A surface as it was received.
struct IgtlSurface {
  std::vector<Vec3f> points_mm;
  std::vector<Triangle> triangles;
};
/// Returns the polygons and triangle strips of a POLYDATA's content as triangles, with one point a place. Throws InputError for
/// content that is damaged, and for a surface that is empty or not closed.
IgtlSurface read_igtl_surface(std::string_view content);

}  // namespace palpate
