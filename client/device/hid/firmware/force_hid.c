#include "client/device/hid/firmware/force_hid.h"

enum { WHOLE_GAIN = 65536, WARMTH_STEPS = 65536, LONGEST_STEP_US = 10000, TORQUE_WARMTH_UNM = 100 };

static uint8_t* put(uint8_t* at, uint32_t value, int bytes) {
  for (int i = 0; i < bytes; ++i) *at++ = (uint8_t)(value >> (8 * i));
  return at;
}

static uint32_t get(const uint8_t* at, int bytes) {
  uint32_t value = 0;
  for (int i = 0; i < bytes; ++i) value |= (uint32_t)at[i] << (8 * i);
  return value;
}

// Two's complement without an implementation-defined conversion.
static int32_t signed32(uint32_t bits) { return bits <= INT32_MAX ? (int32_t)bits : -1 - (int32_t)(UINT32_MAX - bits); }

// Returns the largest integer whose square is not above `square`, a sum of three squares of 32-bit numbers.
static uint64_t square_root(uint64_t square) {
  uint64_t root = 0;
  for (uint64_t bit = (uint64_t)1 << 31; bit != 0; bit >>= 1) {
    const uint64_t tried = root | bit;
    if (tried * tried <= square) root = tried;
  }
  return root;
}

static uint64_t squared(int64_t value) { return (uint64_t)(value * value); }

static void go_to(force_hid_core* core, force_hid_state state) {
  core->state = state;
  core->may_arm = false;
  core->arm = false;
  core->gain = 0;
  if (state != FORCE_HID_STATE_FAULT) core->faults = 0;
  for (int i = 0; i < 3; ++i) core->command_mn[i] = core->command_unm[i] = 0;
}

static uint32_t between(uint32_t value, uint32_t least, uint32_t most) {
  return value < least ? least : value > most ? most : value;
}

void force_hid_init(force_hid_core* core, const force_hid_limits* limits) {
  *core = (force_hid_core){.limits = *limits};
  core->limits.peak_mn = between(limits->peak_mn, 1, FORCE_HID_PEAK_MAX_MN);
  core->limits.continuous_mn = between(limits->continuous_mn, 1, core->limits.peak_mn);
  core->limits.peak_torque_unm = between(limits->peak_torque_unm, 1, FORCE_HID_TORQUE_MAX_UNM);
  core->limits.continuous_torque_unm = between(limits->continuous_torque_unm, 1, core->limits.peak_torque_unm);
  core->limits.watchdog_ms = (uint16_t)between(limits->watchdog_ms, 1, FORCE_HID_WATCHDOG_MAX_MS);
  go_to(core, FORCE_HID_STATE_HOMING);
}

static void take_flags(force_hid_core* core, uint8_t flags) {
  const bool arm = (flags & FORCE_HID_FLAG_ARM) != 0;
  core->ramp = (flags & FORCE_HID_FLAG_RAMP) != 0;
  if (core->state == FORCE_HID_STATE_ARMED) {
    core->arm = arm;
  } else if (!arm) {
    const bool cleared = core->state == FORCE_HID_STATE_FAULT && (flags & FORCE_HID_FLAG_CLEAR) != 0 &&
                         (core->sensors.faults & FORCE_HID_STATUS_FAULTS) == 0;
    if (cleared || core->state == FORCE_HID_STATE_TIMED_OUT) go_to(core, FORCE_HID_STATE_READY);
    core->may_arm = core->state == FORCE_HID_STATE_READY;
  } else if (core->state == FORCE_HID_STATE_READY && core->may_arm) {
    core->state = FORCE_HID_STATE_ARMED;
    core->arm = true;
  }
}

bool force_hid_receive(force_hid_core* core, const uint8_t* report, size_t size, uint32_t now_us) {
  if (size < FORCE_HID_OUTPUT_BYTES || report[0] != FORCE_HID_OUTPUT_ID) return false;
  const uint16_t sequence = (uint16_t)get(report + 1, 2);
  const uint16_t ahead = (uint16_t)(sequence - core->taken_sequence);
  if (core->state == FORCE_HID_STATE_ARMED && (ahead == 0 || ahead > INT16_MAX)) return false;
  core->taken_sequence = sequence;
  core->taken_us = now_us;
  take_flags(core, report[3]);
  if (core->state != FORCE_HID_STATE_ARMED) return true;
  const bool turns = (core->limits.features & FORCE_HID_FEATURE_TORQUE) != 0;
  for (int i = 0; i < 3; ++i) core->command_mn[i] = signed32(get(report + 4 + 4 * i, 4));
  for (int i = 0; i < 3; ++i) core->command_unm[i] = turns ? signed32(get(report + 16 + 4 * i, 4)) : 0;
  return true;
}

static bool too_fast(const force_hid_core* core, const force_hid_sensors* sensors, uint32_t elapsed_us) {
  const int64_t reach_nm = (int64_t)core->limits.speed_max_mm_s * elapsed_us;
  if (core->limits.speed_max_mm_s == 0 || !core->has_position || elapsed_us > LONGEST_STEP_US) return false;
  uint64_t moved = 0;
  for (int i = 0; i < 3; ++i) {
    const int64_t way = (int64_t)sensors->position_nm[i] - core->sensors.position_nm[i];
    if (way > reach_nm || way < -reach_nm) return true;
    moved += squared(way);
  }
  return moved > squared(reach_nm);
}

static void step_state(force_hid_core* core, const force_hid_sensors* sensors, uint16_t faults, uint32_t now_us) {
  if (faults != 0) {
    go_to(core, FORCE_HID_STATE_FAULT);
    core->faults |= faults;
  } else if (core->state == FORCE_HID_STATE_FAULT) {
    return;
  } else if (!sensors->homed) {
    go_to(core, FORCE_HID_STATE_HOMING);
  } else if (core->state == FORCE_HID_STATE_HOMING) {
    go_to(core, FORCE_HID_STATE_READY);
  } else if (core->state == FORCE_HID_STATE_ARMED && now_us - core->taken_us >= 1000u * core->limits.watchdog_ms) {
    go_to(core, FORCE_HID_STATE_TIMED_OUT);
  }
}

static void step_gain(force_hid_core* core, uint32_t dt_us) {
  if (core->state != FORCE_HID_STATE_ARMED) return;
  const uint32_t ramp_us = core->ramp ? 1000u * core->limits.ramp_ms : 0;
  const uint32_t change = ramp_us > dt_us ? (uint32_t)(((uint64_t)WHOLE_GAIN * dt_us + ramp_us - 1) / ramp_us) : WHOLE_GAIN;
  if (core->arm) {
    core->gain = core->gain + change < WHOLE_GAIN ? core->gain + change : WHOLE_GAIN;
  } else if (core->gain > change) {
    core->gain -= change;
  } else {
    go_to(core, FORCE_HID_STATE_READY);
    core->may_arm = true;
  }
}

// Returns the limit at a warmth, `hot` where it reaches the continuous one; see force_hid_limits.
static uint32_t limit_at(const force_hid_core* core, uint64_t warmth, uint64_t hot, uint32_t peak, uint32_t continuous) {
  const uint64_t warm = hot - hot / 4, now = warmth / WARMTH_STEPS;
  if (core->limits.heat_time_ds == 0 || now <= warm) return peak;
  if (now >= hot) return continuous;
  return peak - (uint32_t)((uint64_t)(peak - continuous) * (now - warm) / (hot - warm));
}

static uint32_t force_limit(const force_hid_core* core) {
  const uint32_t continuous = core->limits.continuous_mn;
  return limit_at(core, core->warmth, (uint64_t)continuous * continuous, core->limits.peak_mn, continuous);
}

static uint32_t torque_limit(const force_hid_core* core) {
  const uint32_t continuous = core->limits.continuous_torque_unm;
  const uint64_t steps = continuous < TORQUE_WARMTH_UNM ? 1 : continuous / TORQUE_WARMTH_UNM;
  return limit_at(core, core->torque_warmth, steps * steps, core->limits.peak_torque_unm, continuous);
}

static uint64_t length_squared(const int32_t vector[3]) {
  uint64_t square = 0;
  for (int i = 0; i < 3; ++i) square += squared(vector[i]);
  return square;
}

// Advances a warmth; `square` is below 10^10 unit^2, so the products fit.
static uint64_t warmed(const force_hid_core* core, uint64_t warmth, uint64_t square, uint32_t dt_us) {
  if (core->limits.heat_time_ds == 0) return warmth;
  const int64_t gap = (int64_t)(square * WARMTH_STEPS) - (int64_t)warmth;
  return (uint64_t)((int64_t)warmth + gap * dt_us / (100000 * (int64_t)core->limits.heat_time_ds));
}

static void warm(force_hid_core* core, const int32_t force_mn[3], const int32_t torque_unm[3], uint32_t dt_us) {
  int32_t steps[3];
  for (int i = 0; i < 3; ++i) steps[i] = torque_unm[i] / TORQUE_WARMTH_UNM;
  core->warmth = warmed(core, core->warmth, length_squared(force_mn), dt_us);
  core->torque_warmth = warmed(core, core->torque_warmth, length_squared(steps), dt_us);
}

// A factor of at most 1.
typedef struct {
  int64_t part, whole;
} share;

static share share_of(const int32_t vector[3], uint32_t limit) {
  const uint64_t square = length_squared(vector);
  if (square <= (uint64_t)limit * limit) return (share){1, 1};
  return (share){limit, (int64_t)square_root(square) + 1};
}

static void scale(const int32_t from[3], share by, uint32_t gain, int32_t to[3]) {
  for (int i = 0; i < 3; ++i) to[i] = (int32_t)(from[i] * by.part / by.whole * gain / WHOLE_GAIN);
}

// Computes the command, clamped to the limits by one factor, times the gain.
static void limited_wrench(force_hid_core* core, int32_t force_mn[3], int32_t torque_unm[3]) {
  const uint32_t most_mn = force_limit(core), most_unm = torque_limit(core);
  const share of_force = share_of(core->command_mn, most_mn), of_torque = share_of(core->command_unm, most_unm);
  // Products are below 2^27 * 2^33.
  const bool force_counts = of_force.part * of_torque.whole <= of_torque.part * of_force.whole;
  const share both = force_counts ? of_force : of_torque;
  scale(core->command_mn, both, core->gain, force_mn);
  scale(core->command_unm, both, core->gain, torque_unm);
  if (both.part < both.whole) core->status |= FORCE_HID_STATUS_CLAMPED;
  if (most_mn < core->limits.peak_mn || most_unm < core->limits.peak_torque_unm) core->status |= FORCE_HID_STATUS_WARM;
  if (core->gain > 0 && core->gain < WHOLE_GAIN) core->status |= FORCE_HID_STATUS_RAMPING;
}

void force_hid_step(force_hid_core* core, const force_hid_sensors* sensors, uint32_t now_us, int32_t force_mn[3],
                    int32_t torque_unm[3]) {
  const uint32_t elapsed_us = now_us - core->step_us;
  const uint32_t dt_us = elapsed_us < LONGEST_STEP_US ? elapsed_us : LONGEST_STEP_US;
  uint16_t faults = sensors->faults & FORCE_HID_STATUS_FAULTS;
  if (sensors->homed && too_fast(core, sensors, elapsed_us)) faults |= FORCE_HID_STATUS_TOO_FAST;
  step_state(core, sensors, faults, now_us);
  step_gain(core, dt_us);
  core->step_us = now_us;
  core->has_position = sensors->homed;
  core->sensors = *sensors;
  core->status = core->faults;
  limited_wrench(core, force_mn, torque_unm);
  warm(core, force_mn, torque_unm, dt_us);
}

size_t force_hid_input_report(force_hid_core* core, uint8_t report[FORCE_HID_INPUT_BYTES]) {
  uint8_t* at = put(report, FORCE_HID_INPUT_ID, 1);
  at = put(at, core->input_sequence++, 2);
  at = put(at, core->step_us, 4);
  for (int i = 0; i < 3; ++i) at = put(at, (uint32_t)core->sensors.position_nm[i], 4);
  for (int i = 0; i < 4; ++i) at = put(at, (uint16_t)core->sensors.orientation[i], 2);
  at = put(at, core->sensors.buttons, 2);
  at = put(at, core->status, 2);
  at = put(at, (uint32_t)core->state, 1);
  at = put(at, core->taken_sequence, 2);
  at = put(at, core->sensors.opening, 2);
  return (size_t)(at - report);
}

size_t force_hid_feature_report(const force_hid_core* core, uint8_t report[FORCE_HID_FEATURE_BYTES]) {
  const force_hid_limits* limits = &core->limits;
  uint8_t* at = put(report, FORCE_HID_FEATURE_ID, 1);
  at = put(at, FORCE_HID_VERSION_MAJOR, 1);
  at = put(at, FORCE_HID_VERSION_MINOR, 1);
  at = put(at, limits->firmware_version, 2);
  at = put(at, limits->rate_hz, 2);
  at = put(at, limits->watchdog_ms, 2);
  at = put(at, limits->ramp_ms, 2);
  at = put(at, limits->peak_mn, 4);
  at = put(at, limits->continuous_mn, 4);
  at = put(at, limits->heat_time_ds, 2);
  at = put(at, limits->stiffness_n_m, 4);
  at = put(at, limits->slew_n_s, 4);
  at = put(at, limits->speed_max_mm_s, 2);
  for (int i = 0; i < 3; ++i) at = put(at, (uint32_t)limits->workspace_min_nm[i], 4);
  for (int i = 0; i < 3; ++i) at = put(at, (uint32_t)limits->workspace_max_nm[i], 4);
  at = put(at, limits->buttons, 1);
  at = put(at, limits->features, 1);
  at = put(at, limits->peak_torque_unm, 4);
  at = put(at, limits->continuous_torque_unm, 4);
  at = put(at, limits->torque_slew_mnm_s, 4);
  at = put(at, limits->torsion_mnm_rad, 4);
  at = put(at, limits->spin_max_mrad_s, 2);
  return (size_t)(at - report);
}
