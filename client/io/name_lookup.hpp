// Resolves the address of a name without blocking: neither the calling thread nor the end of the program waits.
//
// The resolver of the C library may take tens of seconds and cannot be cancelled, so it runs on a detached thread.
#pragma once

#include <chrono>
#include <functional>
#include <future>
#include <optional>
#include <string>
#include <thread>
#include <utility>

#include "common/base/error.hpp"
#include "common/io/endpoint.hpp"

namespace palpate {

class NameLookup {
 public:
  using Ask = std::function<UdpEndpoint(const std::string& name)>;  ///< throws InputError when there is no such name

  explicit NameLookup(Ask ask) : ask_(std::move(ask)) {}

  bool busy() const { return answer_.valid(); }
  void begin(const std::string& name) {
    std::promise<std::optional<UdpEndpoint>> promise;
    answer_ = promise.get_future();
    std::thread([ask = ask_, name, promise = std::move(promise)]() mutable {
      try {
        promise.set_value(ask(name));
      } catch (const InputError&) {
        promise.set_value(std::nullopt);
      }
    }).detach();
  }
  /// Returns the result of the last begin(), once, when it is there; no address where the name has none.
  std::optional<std::optional<UdpEndpoint>> take() {
    if (!busy() || answer_.wait_for(std::chrono::seconds(0)) != std::future_status::ready) return std::nullopt;
    return answer_.get();
  }

 private:
  Ask ask_;
  std::future<std::optional<UdpEndpoint>> answer_;
};

}  // namespace palpate
