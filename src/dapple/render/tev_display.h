// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstdint>
#include <string>
#include <vector>

#include "dapple/base/stop_token.h"
#include "dapple/image/image_writer.h"

namespace dapple::render {

/// Where the image viewer tev listens: its own default, or what "tev:HOST:PORT" says.
struct TevAddress {
  std::string host = "127.0.0.1", port = "14158";

  /// Of "tev", "tev:HOST" or "tev:HOST:PORT"; UsageError for a port that is none.
  explicit TevAddress(const std::string& text);
  /// Whether the text means tev.
  static bool is_meant(const std::string& text) { return text == "tev" || text.starts_with("tev:"); }
  std::string to_string() const { return host + ":" + port; }
};

/// Shows pictures in tev, over TCP. A packet is its length and a kind, then what the kind has, with little-endian
/// integers and strings that end with zero (tev's README, "Over the network"): CreateImage for a new set of channels,
/// UpdateImage for all pixels of each.
class TevDisplay {
 public:
  /// Connects. IoError where nobody listens. What is being shown is given up when `stop` says so.
  TevDisplay(const TevAddress& address, std::string image_name, StopToken stop = {});
  ~TevDisplay();
  TevDisplay(const TevDisplay&) = delete;
  TevDisplay& operator=(const TevDisplay&) = delete;

  /// May be asked from any thread.
  bool is_open() const { return socket_ >= 0; }
  /// All layers, over the whole frame. Does nothing once the viewer has gone, or has not taken a channel within some
  /// seconds, which is said; nor once stopped.
  void show(const image::OutputImage& picture);

 private:
  void send(const std::string& payload);
  void leave();

  const std::string address_, name_;
  const StopToken stop_;
  std::atomic<int> socket_{-1};
  std::vector<std::string> channels_;  ///< of the image that the viewer has
  int width_ = 0, height_ = 0;
};

}  // namespace dapple::render
