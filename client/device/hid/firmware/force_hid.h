// The force-device HID profile and its reference firmware: the USB protocol of a do-it-yourself haptic device that
// palpate-client finds, checks and uses without a driver. docs/reference/hid-profile.md describes the whole profile in prose;
// this file is the only list of its bytes, shared by firmware and host.
//
// Portable C11: no operating system, no heap, no clock, no floating point, nothing beyond <stdint.h>, <stddef.h>, <stdbool.h>.
// Time is passed in as microseconds that wrap around at 2^32. The author of a device supplies encoders and motors as plain
// numbers:
//
//     force_hid_init(&core, &limits);                                  // once
//     on an OUT report:         force_hid_receive(&core, bytes, size, now_us);
//     every control period:     force_hid_step(&core, &sensors, now_us, force_mn, torque_unm);   // then motors: tau = J^T of
//     both on every IN interval:     size = force_hid_input_report(&core, bytes); on GET_REPORT(feature):   size =
//     force_hid_feature_report(&core, bytes);
//
// Calls must not interrupt each other: where receive() runs in an interrupt, mask it during step().
//
// step() guarantees, whatever bytes arrived: force and torque are zero unless the state is ARMED, the torque also without
// FORCE_HID_FEATURE_TORQUE; the norm of each is at most its peak, and falls to the continuous one as the motors warm (see
// force_hid_limits); both are scaled by one factor, which keeps the line of action; after watchdog_ms without a fresh report it
// is zero until the host has disarmed and armed again.
#ifndef PALPATE_FORCE_HID_H
#define PALPATE_FORCE_HID_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

enum { FORCE_HID_VERSION_MAJOR = 1, FORCE_HID_VERSION_MINOR = 0 };

// Usages on the vendor page FORCE_HID_PAGE. Each has one field; a host finds fields by usage, never by report id or offset.
enum {
  FORCE_HID_PAGE = 0xFF46,
  FORCE_HID_DEVICE = 0x01,  // the application collection
  // input
  FORCE_HID_SEQUENCE = 0x10,       // counter of input reports, wraps
  FORCE_HID_CLOCK = 0x11,          // time of the position reading [us], wraps
  FORCE_HID_POSITION_X = 0x12,     // [nm]; Y, Z follow
  FORCE_HID_ORIENTATION_X = 0x15,  // unit quaternion times 32767; Y, Z, W follow; optional
  FORCE_HID_BUTTONS = 0x19,        // bit n: button n is pressed
  FORCE_HID_STATUS = 0x1A,         // FORCE_HID_STATUS_...
  FORCE_HID_STATE = 0x1B,          // force_hid_state
  FORCE_HID_TAKEN = 0x1C,          // sequence of the newest accepted output report
  FORCE_HID_OPENING = 0x1D,        // of a gripper, 0 closed to 65535 wide open; optional
  // output
  FORCE_HID_COMMAND = 0x20,   // counter of output reports, wraps
  FORCE_HID_FLAGS = 0x21,     // FORCE_HID_FLAG_...
  FORCE_HID_FORCE_X = 0x22,   // [mN]; Y, Z follow
  FORCE_HID_TORQUE_X = 0x25,  // about the position [uN m]; Y, Z follow; optional
  // feature
  FORCE_HID_MAJOR = 0x30,
  FORCE_HID_MINOR = 0x31,
  FORCE_HID_FIRMWARE = 0x32,         // the device's own version number
  FORCE_HID_RATE = 0x33,             // input reports a second [Hz]
  FORCE_HID_WATCHDOG = 0x34,         // [ms]
  FORCE_HID_RAMP = 0x35,             // [ms]
  FORCE_HID_PEAK = 0x36,             // [mN]
  FORCE_HID_CONTINUOUS = 0x37,       // [mN]
  FORCE_HID_HEAT_TIME = 0x38,        // [0.1 s]
  FORCE_HID_STIFFNESS = 0x39,        // [N/m]
  FORCE_HID_SLEW = 0x3A,             // [N/s]
  FORCE_HID_SPEED = 0x3B,            // [mm/s]
  FORCE_HID_WORKSPACE_MIN_X = 0x3C,  // [nm]; Y, Z follow
  FORCE_HID_WORKSPACE_MAX_X = 0x3F,  // [nm]; Y, Z follow
  FORCE_HID_BUTTON_COUNT = 0x42,
  FORCE_HID_FEATURES = 0x43,  // FORCE_HID_FEATURE_...
  // with FORCE_HID_FEATURE_TORQUE
  FORCE_HID_PEAK_TORQUE = 0x44,        // [uN m]
  FORCE_HID_CONTINUOUS_TORQUE = 0x45,  // [uN m]
  FORCE_HID_TORQUE_SLEW = 0x46,        // [mN m/s]
  FORCE_HID_TORSION = 0x47,            // [mN m/rad]
  FORCE_HID_SPIN = 0x48                // [mrad/s]
};

// Report ids of the reference descriptor, and report sizes, id included.
enum {
  FORCE_HID_INPUT_ID = 1,
  FORCE_HID_OUTPUT_ID = 2,
  FORCE_HID_FEATURE_ID = 3,
  FORCE_HID_INPUT_BYTES = 36,
  FORCE_HID_OUTPUT_BYTES = 28,
  FORCE_HID_FEATURE_BYTES = 75,
  FORCE_HID_DESCRIPTOR_BYTES = 404
};

enum { FORCE_HID_PEAK_MAX_MN = 100000, FORCE_HID_TORQUE_MAX_UNM = 10000000, FORCE_HID_WATCHDOG_MAX_MS = 100 };

enum {
  FORCE_HID_FLAG_ARM = 1,   // render this force; the first report with it after one without arms
  FORCE_HID_FLAG_RAMP = 2,  // arming or disarming takes ramp_ms instead of no time
  FORCE_HID_FLAG_CLEAR = 4  // leave FAULT, if its cause is gone and ARM is not set
};

typedef enum {
  FORCE_HID_STATE_HOMING = 0,     // the position is not valid yet
  FORCE_HID_STATE_READY = 1,      // no force
  FORCE_HID_STATE_ARMED = 2,      // the only state with force
  FORCE_HID_STATE_TIMED_OUT = 3,  // the watchdog switched the force off: disarm to continue
  FORCE_HID_STATE_FAULT = 4       // a status bit below names the cause
} force_hid_state;

enum {
  // faults: any of them ends ARMED at once
  FORCE_HID_STATUS_TOO_HOT = 1,   // motor or driver
  FORCE_HID_STATUS_TOO_FAST = 2,  // the tool was faster than the limit
  FORCE_HID_STATUS_ENCODER = 4,   // a position is unreliable
  FORCE_HID_STATUS_MOTOR = 8,     // driver, supply or current sensing
  FORCE_HID_STATUS_SWITCH = 16,   // an emergency or dead-man switch is open
  FORCE_HID_STATUS_FAULTS = 31,
  // conditions without a fault
  FORCE_HID_STATUS_CLAMPED = 256,  // the newest force exceeded the current limit
  FORCE_HID_STATUS_WARM = 512,     // the current limit is below the peak, because the motors are warm
  FORCE_HID_STATUS_RAMPING = 1024
};

enum { FORCE_HID_FEATURE_ORIENTATION = 1, FORCE_HID_FEATURE_TORQUE = 2, FORCE_HID_FEATURE_OPENING = 4 };

extern const uint8_t force_hid_descriptor[FORCE_HID_DESCRIPTOR_BYTES];

// Properties of the device, sent in the feature report; force_hid_init() clamps them to their ranges. The warmth of the motors is
// h' = (|F|^2 - h) / heat_time with h = 0 when cold: the force limit falls linearly from the peak at h = 3/4 continuous^2 to the
// continuous force at h = continuous^2. Torque likewise, with a warmth of its own.
typedef struct {
  uint16_t firmware_version;
  uint16_t rate_hz;
  uint16_t watchdog_ms;    // 1 to FORCE_HID_WATCHDOG_MAX_MS
  uint16_t ramp_ms;        // 0: arming is immediate
  uint32_t peak_mn;        // 1 to FORCE_HID_PEAK_MAX_MN
  uint32_t continuous_mn;  // 1 to the peak
  uint16_t heat_time_ds;   // tenths of a second; 0: the peak may be held indefinitely
  uint32_t stiffness_n_m;
  uint32_t slew_n_s;
  uint16_t speed_max_mm_s;  // 0: not monitored
  int32_t workspace_min_nm[3], workspace_max_nm[3];
  uint8_t buttons;
  uint8_t features;
  // with FORCE_HID_FEATURE_TORQUE
  uint32_t peak_torque_unm;        // 1 to FORCE_HID_TORQUE_MAX_UNM
  uint32_t continuous_torque_unm;  // 1 to the peak
  uint32_t torque_slew_mnm_s;
  uint32_t torsion_mnm_rad;  // 0: not known
  uint16_t spin_max_mrad_s;
} force_hid_limits;

// Readings of encoders and switches, once a control period.
typedef struct {
  bool homed;
  uint16_t faults;  // FORCE_HID_STATUS_FAULTS bits that are set now; step() detects TOO_FAST as well
  int32_t position_nm[3];
  int16_t orientation[4];  // x, y, z, w times 32767; all 0 without an orientation
  uint16_t buttons;
  uint16_t opening;  // 0 closed to 65535 wide open; 0 without a gripper
} force_hid_sensors;

typedef struct {
  force_hid_limits limits;
  force_hid_sensors sensors;
  force_hid_state state;
  bool may_arm;       // true: a report without ARM was accepted since the state became READY
  bool arm, ramp;     // flags of the newest report
  bool has_position;  // true: a step() has run while homed
  uint16_t faults;    // cause of FAULT, kept until it is left
  uint16_t status;
  uint16_t input_sequence, taken_sequence;
  int32_t command_mn[3], command_unm[3];
  uint32_t gain;                   // 0 to 65536
  uint64_t warmth, torque_warmth;  // h in 2^-16 mN^2; in 2^-16 (100 uN m)^2
  uint32_t step_us, taken_us;
} force_hid_core;

void force_hid_init(force_hid_core* core, const force_hid_limits* limits);

// Processes one output report, id first. Returns false for a rejected report: another id, too short, or while ARMED not newer
// than the last one. A rejected report does not reset the watchdog.
bool force_hid_receive(force_hid_core* core, const uint8_t* report, size_t size, uint32_t now_us);

// Runs one control period: state, watchdog, limits. `force_mn`, `torque_unm`: for the motors to render now.
void force_hid_step(force_hid_core* core, const force_hid_sensors* sensors, uint32_t now_us, int32_t force_mn[3],
                    int32_t torque_unm[3]);

// Writes the report, id first, and returns its size.
size_t force_hid_input_report(force_hid_core* core, uint8_t report[FORCE_HID_INPUT_BYTES]);
size_t force_hid_feature_report(const force_hid_core* core, uint8_t report[FORCE_HID_FEATURE_BYTES]);

#ifdef __cplusplus
}
#endif

#endif
