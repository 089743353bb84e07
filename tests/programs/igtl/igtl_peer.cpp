// A program that talks OpenIGTLink through its library, as 3D Slicer does.
//
//     igtl_peer listen PORT BODIES           prints what it receives, until BODIES surfaces have come
//     igtl_peer send PORT RADIUS_MM [open]   sends the surface of a ball around (100, -50, 20) mm, or one with a hole
#include <igtlClientSocket.h>
#include <igtlMessageHeader.h>
#include <igtlPolyDataMessage.h>
#include <igtlSensorMessage.h>
#include <igtlTransformMessage.h>

#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <string>

#include "tests/client/igtl/ball.hpp"

using namespace palpate;

namespace {

void print_transform(igtl::TransformMessage& message) {
  igtl::Matrix4x4 m;
  message.GetMatrix(m);
  std::printf("TRANSFORM %s %.4f %.4f %.4f\n", message.GetDeviceName(), static_cast<double>(m[0][3]),
              static_cast<double>(m[1][3]), static_cast<double>(m[2][3]));
}

void print_force(igtl::SensorMessage& message) {
  std::printf("SENSOR %s %.4f %.4f %.4f\n", message.GetDeviceName(), message.GetValue(0), message.GetValue(1),
              message.GetValue(2));
}

void print_surface(igtl::PolyDataMessage& message) {
  Vec3f low = Vec3f::Constant(1e9F), high = -low;
  for (int k = 0; k < message.GetPoints()->GetNumberOfPoints(); ++k) {
    Vec3f point;
    message.GetPoints()->GetPoint(static_cast<unsigned>(k), point.data());
    low = low.cwiseMin(point);
    high = high.cwiseMax(point);
  }
  std::vector<float> scalars(message.GetAttribute(0)->GetSize());
  message.GetAttribute(0)->GetData(scalars.data());
  float most = 0;
  for (const float scalar : scalars) most = std::max(most, scalar);
  std::printf("POLYDATA %s %d %u %.3f %.3f %.3f %.3f %.3f %.3f %.3f\n", message.GetDeviceName(),
              message.GetPoints()->GetNumberOfPoints(), message.GetPolygons()->GetNumberOfCells(), static_cast<double>(low.x()),
              static_cast<double>(low.y()), static_cast<double>(low.z()), static_cast<double>(high.x()),
              static_cast<double>(high.y()), static_cast<double>(high.z()), static_cast<double>(most));
}

template <class Message>
bool receive(igtl::ClientSocket& socket, igtl::MessageHeader::Pointer& header, void (*print)(Message&)) {
  const auto message = Message::New();
  message->SetMessageHeader(header);
  message->AllocatePack();
  if (socket.Receive(message->GetPackBodyPointer(), message->GetPackBodySize()) != message->GetPackBodySize()) return false;
  if ((message->Unpack(1) & igtl::MessageHeader::UNPACK_BODY) == 0) return false;  // its CRC is wrong
  print(*message);
  return true;
}

int listen(igtl::ClientSocket& socket, int bodies) {
  while (bodies > 0) {
    auto header = igtl::MessageHeader::New();
    header->InitPack();
    if (socket.Receive(header->GetPackPointer(), header->GetPackSize()) != header->GetPackSize()) return 1;
    header->Unpack();
    const std::string type = header->GetDeviceType();
    bool good = false;
    if (type == "TRANSFORM") good = receive<igtl::TransformMessage>(socket, header, print_transform);
    if (type == "SENSOR") good = receive<igtl::SensorMessage>(socket, header, print_force);
    if (type == "POLYDATA") good = receive<igtl::PolyDataMessage>(socket, header, print_surface);
    if (!good) return 1;
    bodies -= type == "POLYDATA";
  }
  return 0;
}

int send(igtl::ClientSocket& socket, float radius_mm, bool open) {
  auto [points, triangles] = test::ball(Vec3f(100, -50, 20), radius_mm, 32);
  if (open) triangles.pop_back();
  const auto places = igtl::PolyDataPointArray::New();
  for (const Vec3f& p : points) places->AddPoint(p.x(), p.y(), p.z());
  const auto polygons = igtl::PolyDataCellArray::New();
  for (Triangle& triangle : triangles) polygons->AddCell(3, triangle.data());
  const auto message = igtl::PolyDataMessage::New();
  message->SetDeviceName("Segment_1");
  message->SetPoints(places);
  message->SetPolygons(polygons);
  message->Pack();
  return socket.Send(message->GetPackPointer(), message->GetPackSize()) ? 0 : 1;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 4) return 2;
  const auto socket = igtl::ClientSocket::New();
  if (socket->ConnectToServer("127.0.0.1", std::atoi(argv[2])) != 0) return 1;
  const int result = std::string(argv[1]) == "listen" ? listen(*socket, std::atoi(argv[3]))
                                                      : send(*socket, static_cast<float>(std::atof(argv[3])), argc > 4);
  socket->CloseSocket();
  return result;
}
