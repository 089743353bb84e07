// The library of OpenIGTLink reads what is sent, and what it sends is read. Compiled only where the library is there.
#ifdef PALPATE_OPENIGTLINK
#include <igtlMessageHeader.h>
#include <igtlPolyDataMessage.h>
#include <igtlSensorMessage.h>
#include <igtlTransformMessage.h>
#include <igtlUnit.h>

#include <catch2/catch.hpp>
#include <cstring>

#include "client/igtl/igtl_messages.hpp"
#include "tests/client/igtl/ball.hpp"

using namespace palpate;

namespace {

/// Unpacks a message with the library, which checks the CRC.
template <class Message>
typename Message::Pointer unpacked(const std::string& bytes) {
  const auto header = igtl::MessageHeader::New();
  header->InitPack();
  REQUIRE(static_cast<std::size_t>(header->GetPackSize()) <= bytes.size());
  std::memcpy(header->GetPackPointer(), bytes.data(), static_cast<std::size_t>(header->GetPackSize()));
  REQUIRE((header->Unpack() & igtl::MessageHeader::UNPACK_HEADER) != 0);
  const auto message = Message::New();
  message->SetMessageHeader(header);
  message->AllocatePack();
  const auto body = static_cast<std::size_t>(message->GetPackBodySize());
  REQUIRE(bytes.size() == static_cast<std::size_t>(header->GetPackSize()) + body);
  std::memcpy(message->GetPackBodyPointer(), bytes.data() + header->GetPackSize(), body);
  REQUIRE((message->Unpack(1) & igtl::MessageHeader::UNPACK_BODY) != 0);
  return message;
}

}  // namespace

TEST_CASE("OpenIGTLink's library reads a TRANSFORM as it was meant", "[igtl]") {
  Mat3 rotation;
  rotation << 0, -1, 0, 0, 0, -1, 1, 0, 0;
  const auto message =
      unpacked<igtl::TransformMessage>(igtl_transform("or 3", rotation, Vec3(1.5, -2, 0.25), 5ULL << 32 | 1U << 31));
  igtl::Matrix4x4 matrix;
  message->GetMatrix(matrix);
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) CHECK(matrix[row][column] == rotation(row, column));
  }
  CHECK(matrix[0][3] == 1.5F);
  CHECK(matrix[1][3] == -2);
  CHECK(matrix[2][3] == 0.25F);
  CHECK(std::string(message->GetDeviceName()) == "or 3");
  unsigned int whole = 0, part = 0;
  message->GetTimeStamp(&whole, &part);
  CHECK(whole == 5);
}

TEST_CASE("OpenIGTLink's library reads a force in newtons", "[igtl]") {
  const auto message = unpacked<igtl::SensorMessage>(igtl_force("or 3 force", Vec3(0.5, -1.25, 3), 1));
  REQUIRE(message->GetLength() == 3);
  CHECK(message->GetValue(0) == 0.5);
  CHECK(message->GetValue(1) == -1.25);
  CHECK(message->GetValue(2) == 3);
  const auto newton = igtl::Unit::New();
  newton->Append(igtl::Unit::SI_DERIVED_NEWTON, 1);
  CHECK(message->GetUnit() == newton->Pack());
}

TEST_CASE("OpenIGTLink's library reads a surface with its scalars", "[igtl]") {
  const auto [points, triangles] = test::ball(Vec3f(10, 20, 30), 40);
  std::vector<float> scalars;
  for (std::size_t k = 0; k < points.size(); ++k) scalars.push_back(0.5F * static_cast<float>(k));
  for (const char* name : {"odd", "even"}) {
    const auto message = unpacked<igtl::PolyDataMessage>(igtl_polydata("body", points, triangles, name, scalars, 1));
    REQUIRE(message->GetPoints()->GetNumberOfPoints() == static_cast<int>(points.size()));
    REQUIRE(message->GetPolygons()->GetNumberOfCells() == triangles.size());
    for (std::size_t k = 0; k < points.size(); ++k) {
      Vec3f point;
      message->GetPoints()->GetPoint(static_cast<unsigned>(k), point.data());
      CHECK(point == points[k]);
    }
    for (std::size_t k = 0; k < triangles.size(); ++k) {
      REQUIRE(message->GetPolygons()->GetCellSize(static_cast<unsigned>(k)) == 3);
      Triangle cell{};
      message->GetPolygons()->GetCell(static_cast<unsigned>(k), cell.data());
      CHECK(cell == triangles[k]);
    }
    REQUIRE(message->GetNumberOfAttributes() == 1);
    igtl::PolyDataAttribute* attribute = message->GetAttribute(0);
    CHECK(std::string(attribute->GetName()) == name);
    CHECK(attribute->GetType() == igtl::PolyDataAttribute::POINT_SCALAR);
    REQUIRE(attribute->GetSize() == scalars.size());
    std::vector<float> read(scalars.size());
    attribute->GetData(read.data());
    CHECK(read == scalars);
  }
}

TEST_CASE("A surface that OpenIGTLink's library sends is read, as polygons and as strips", "[igtl]") {
  const auto [points, triangles] = test::ball(Vec3f(10, 20, 30), 40);
  const auto message = igtl::PolyDataMessage::New();
  message->SetDeviceName("Segment_1");
  const auto places = igtl::PolyDataPointArray::New();
  for (const Vec3f& p : points) places->AddPoint(p.x(), p.y(), p.z());
  const auto polygons = igtl::PolyDataCellArray::New(), strips = igtl::PolyDataCellArray::New();
  for (std::size_t k = 0; k < triangles.size(); ++k) {
    Triangle cell = triangles[k];
    (k % 2 == 0 ? polygons : strips)->AddCell(3, cell.data());
  }
  message->SetPoints(places);
  message->SetPolygons(polygons);
  message->SetTriangleStrips(strips);
  message->Pack();
  IgtlReader reader;
  reader.add({static_cast<const char*>(message->GetPackPointer()), static_cast<std::size_t>(message->GetPackSize())});
  const auto received = reader.next();
  REQUIRE(received);
  CHECK(received->name == "Segment_1");
  const IgtlSurface surface = read_igtl_surface(received->content);
  CHECK(surface.points_mm.size() == points.size());
  CHECK(surface.triangles.size() == triangles.size());
}
#endif
