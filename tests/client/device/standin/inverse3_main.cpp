// The stand-in for Haply's Inverse Service as a program: prints its port, serves devices with these ids until its input ends.
//
//     standin_inverse3 ID...        environment: standin.hpp
#include <cstdio>
#include <string>
#include <vector>

#include "tests/client/device/standin/inverse3_service.hpp"

int main(int argc, char** argv) {
  palpate::test::Inverse3Service service(std::vector<std::string>(argv + 1, argv + argc));
  std::printf("%d\n", static_cast<int>(service.port()));
  std::fflush(stdout);
  while (std::getchar() != EOF) {
  }
  const auto breaches = service.breaches();
  for (const std::string& breach : breaches) std::printf("%s\n", breach.c_str());
  return breaches.empty() ? 0 : 1;
}
