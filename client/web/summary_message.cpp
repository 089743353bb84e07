#include "client/web/summary_message.hpp"

#include <nlohmann/json.hpp>

#include "common/assessment/session_metrics.hpp"
#include "common/assessment/task_attempts.hpp"

namespace palpate {
namespace {

using Json = nlohmann::json;

Json hand_json(const SessionHand& hand) {
  Json j{{"name", hand.name}};
  each_figure(session_metrics(hand, kOverN), [&](const char* name, const auto& value) { j[name] = value; });
  return j;
}

}  // namespace

std::string summary_message(const RecordingReader& recording) {
  const Session session = read_session(recording);
  Json j{{"type", "summary"},      {"threshold_n", kOverN},     {"force_rate_hz", recording.head().rate_hz},
         {"hands", Json::array()}, {"guidance", Json::array()}, {"attempts", Json::array()}};
  for (const SessionHand& hand : session.hands) j["hands"].push_back(hand_json(hand));
  for (const SessionGuidance& hold : session.guidances)
    j["guidance"].push_back({{"guide", hold.guide},
                             {"guided", hold.guided},
                             {"from_s", hold.from_s},
                             {"duration_s", hold.to_s - hold.from_s},
                             {"guide_force_mean_n", hold.guide_force_n},
                             {"guided_force_mean_n", hold.guided_force_n}});
  for (const TaskAttempt& a : task_attempts(recording))
    j["attempts"].push_back({{"station", a.station},
                             {"attempt", a.number},
                             {"begin_s", a.begin_s},
                             {"score", a.progress.score},
                             {"time_s", a.progress.time_s},
                             {"text", in_words(*recording.head().task, a.progress)}});
  return j.dump(-1, ' ', false, Json::error_handler_t::replace);
}

}  // namespace palpate
