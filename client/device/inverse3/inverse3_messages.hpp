// JSON of Haply's Inverse Service, as its documentation of version 3.5 has it (docs/reference/devices.md):
//
//     first message, from the service   {"session_id": 7, "inverse3": [{"device_id": "049D", "config": {"type": "inverse3", ...},
//                                        "state": {...}, "status": {...}}, ...]}
//     command                           {"inverse3": [{"device_id": "049D", "commands": {"set_cursor_force": {"vector": {x, y,
//     z}}}}]} answer, one to each command       {"inverse3": [{"device_id": "049D", "state": {"cursor_position": {x, y, z}, ...},
//                                        "status": {"calibrated": true, ...}}, ...]}
//
// Metres and newtons; x right, y forward, z up, which is frame W. Versions 3.1 to 3.4 send no session_id and name the force
// "values".
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/types.hpp"

namespace palpate {

/// Version of the service's JSON.
enum class Inverse3Format : std::uint8_t { v3_1, v3_5 };

/// First message of the service.
struct Inverse3Inventory {
  struct Listed {
    std::string id;
    std::string type;  ///< "inverse3", "inverse3x" or "minverse"; empty: not stated
  };
  std::vector<Listed> devices;
  Inverse3Format format = Inverse3Format::v3_1;
};
/// Throws InputError for a text that is no such message. Devices without a usable id are left out.
Inverse3Inventory read_inverse3_inventory(std::string_view message);

/// Content of an answer for one device.
struct Inverse3State {
  enum class Kind : std::uint8_t {
    malformed,  ///< the text is no JSON object with a list "inverse3"
    unlisted,   ///< the list lacks the device
    listed
  };
  Kind kind = Kind::malformed;
  Vec3 position = Vec3::Zero();  ///< cursor_position [m]; NaN where a coordinate is missing or no number
  bool calibrated = true;        ///< false only where the service says so
};
Inverse3State read_inverse3_state(std::string_view message, std::string_view id);

/// Returns a command that sets the force [N], finite. `first`: that of a session, which also gives it a name and, from
/// version 3.5 on, places the origin in the middle of the workspace with the arm towards the person (preset arm_front_centered).
std::string inverse3_command(Inverse3Format format, std::string_view id, const Vec3& force, bool first);

}  // namespace palpate
