// Every limit of the system in one place, tied together by static assertions.
#pragma once

#include <cstddef>

namespace palpate {

inline constexpr std::size_t kMaxDatagramBytes = 1200;  ///< UDP payload that crosses any path unfragmented
inline constexpr int kMaxModes = 17;                    ///< modes r of a patch; states are 2 r
inline constexpr int kMaxPortVertices = 24;             ///< vertices of a patch's local surface
inline constexpr int kMaxPortTriangles = 40;            ///< triangles of a patch's local surface
inline constexpr int kMaxSamplesPerDatagram = 64;       ///< tool samples in one datagram
inline constexpr int kMaxTurnsPerDatagram = 46;         ///< and in one where each has an orientation
inline constexpr int kMaxOpeningsPerDatagram = 41;      ///< and an opening of jaws
inline constexpr std::size_t kMostBodies = 8;           ///< deformable bodies of a scene
inline constexpr int kMaxNameBytes = 64;                ///< station and scene names
inline constexpr int kMaxStations = 64;                 ///< stations of one room
inline constexpr int kHapticRateHz = 1000;
inline constexpr int kSampleHistoryTicks = 4096;                ///< tool samples that a client keeps to replay patches over
inline constexpr double kWorldExtentM = 10.0;                   ///< positions beyond this are refused
inline constexpr double kMinRateHz = 1.0, kMaxRateHz = 1000.0;  ///< frame rate of a server
inline constexpr double kMaxDeadband = 0.5;                     ///< share of a force by which patches may deliberately be wrong

static_assert(kSampleHistoryTicks >= 4 * kHapticRateHz, "a patch up to 4 s old can be caught up with");

}  // namespace palpate
