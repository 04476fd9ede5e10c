// SPDX-License-Identifier: Apache-2.0
// dapple render --display tev: a viewer of our own takes what is sent, and has the picture that is written.
#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/socket.h>
#include <unistd.h>

#include <chrono>
#include <cstring>
#include <map>
#include <thread>

#include "tests/support/dapple_program.h"
#include "tests/support/exr_layers.h"

namespace dapple::test {
namespace {

/// Reads packets as tev does, until the other side closes.
class Viewer {
 public:
  Viewer() : listener_(socket(AF_INET, SOCK_STREAM, 0)) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socklen_t size = sizeof address;
    auto* const plain = reinterpret_cast<sockaddr*>(&address);
    if (bind(listener_, plain, size) != 0 || listen(listener_, 1) != 0 || getsockname(listener_, plain, &size) != 0)
      throw std::runtime_error("no socket");
    port_ = ntohs(address.sin_port);
  }
  ~Viewer() {
    finish();
    close(listener_);
  }
  int port() const { return port_; }
  /// Closes after so many packets, if that is above 0.
  void start(int most_packets = 0) {
    thread_ = std::thread([this, most_packets] {
      const int connection = accept(listener_, nullptr, nullptr);
      while (read_packet(connection) && ++packets != most_packets) {
      }
      close(connection);
    });
  }
  void finish() {
    if (thread_.joinable()) thread_.join();
  }

  std::string name, error;
  int packets = 0, creations = 0, updates = 0;
  uint32_t width = 0, height = 0;
  std::map<std::string, std::vector<float>> channels;

 private:
  static bool read_all(int from, char* to, size_t n) {
    for (size_t got = 0; got < n;) {
      const ssize_t k = read(from, to + got, n - got);
      if (k <= 0) return false;
      got += size_t(k);
    }
    return true;
  }
  bool read_packet(int from) {
    char head[4];
    if (!read_all(from, head, 4)) return false;
    at_ = 0;
    packet_.assign(head, head + 4);
    const uint32_t length = number();
    packet_.resize(length);
    if (length < 6 || !read_all(from, packet_.data() + 4, length - 4)) return false;
    const int operation = packet_[4];
    at_ = 6;
    name = text();
    if (operation == 4) {
      ++creations;
      channels.clear();
      width = number(), height = number();
      for (uint32_t n = number(); n > 0; --n) channels[text()].resize(size_t(width) * height);
    } else if (operation == 3) {
      ++updates;
      const std::string channel = text();
      if (!channels.contains(channel)) error = "no channel " + channel;
      const uint32_t x0 = number(), y0 = number(), w = number(), h = number();
      if (x0 + w > width || y0 + h > height) error = "beyond the image";
      for (uint32_t y = y0; y < y0 + h; ++y)
        for (uint32_t x = x0; x < x0 + w; ++x) {
          const uint32_t bits = number();
          std::memcpy(&channels[channel][size_t(y) * width + x], &bits, 4);
        }
    } else {
      error = "operation " + std::to_string(operation);
    }
    if (at_ != packet_.size()) error = "a packet of another length";
    return error.empty();
  }
  uint32_t number() {
    uint32_t v = 0;
    for (int i = 0; i < 4; ++i) v |= uint32_t(uint8_t(packet_.at(at_++))) << (8 * i);
    return v;
  }
  std::string text() {
    const std::string t(&packet_.at(at_));
    at_ += t.size() + 1;
    return t;
  }

  int listener_, port_ = 0;
  std::vector<char> packet_;
  size_t at_ = 0;
  std::thread thread_;
};

const std::string cornell = std::string(DAPPLE_SOURCE_DIR) + "/scenes/cornell-box/cornell.pbrt";

TEST(Tev, HasAllLayersOfTheImageThatIsWritten) {
  ScratchFolder folder;
  const std::string image = folder.file("image.exr");
  Viewer viewer;
  viewer.start();
  const ProcessResult run =
      run_dapple({"render",  cornell,        "-o",        image,
                  "--float", "--integrator", "path",      "--resolution",
                  "48x40",   "--crop",       "8,4,40,36", "--pixel-samples",
                  "600",     "--threads",    "4",         "--light-groups",
                  "--aov",   "depth,albedo", "--display", "tev:127.0.0.1:" + std::to_string(viewer.port())},
                 120);
  ASSERT_EQ(run.exit_code, 0) << run.output;
  viewer.finish();
  EXPECT_EQ(viewer.error, "");
  EXPECT_EQ(viewer.name, image);
  EXPECT_EQ(viewer.creations, 1);
  EXPECT_EQ(viewer.width, 48u);
  EXPECT_EQ(viewer.height, 40u);
  const ExrLayers written(image);
  EXPECT_EQ(viewer.channels.size(), written.names().size());
  EXPECT_GE(viewer.updates, 2 * int(viewer.channels.size()));  // of the first picture and the last at least
  for (const auto& [channel, pixels] : viewer.channels) {
    ASSERT_TRUE(written.has(channel)) << channel;
    size_t i = 0;
    for (size_t y = 4; y < 36; ++y)
      for (size_t x = 8; x < 40; ++x) ASSERT_EQ(pixels[y * 48 + x], written[channel][i++]) << channel;
    EXPECT_EQ(pixels[0], 0);
  }
}

// It connects, and then takes less than a picture.
TEST(Tev, StuckHoldsUpNoInterrupt) {
  ScratchFolder folder;
  const Viewer viewer;
  Process process({DAPPLE_BINARY, "render", cornell, "-o", folder.file("image.exr"), "--integrator", "path",
                   "--resolution", "2048x2048", "--denoise", "off", "--pixel-samples", "1000000", "--light-groups",
                   "--display", "tev:127.0.0.1:" + std::to_string(viewer.port())});
  std::this_thread::sleep_for(std::chrono::milliseconds(sanitized() ? 15000 : 1500));
  process.send(SIGINT);
  const auto begin = std::chrono::steady_clock::now();
  const ProcessResult result = process.wait(60);
  EXPECT_EQ(result.exit_code, 130) << result.output;
  EXPECT_LT(std::chrono::steady_clock::now() - begin, std::chrono::seconds(sanitized() ? 30 : 10)) << result.output;
}

TEST(Tev, MayGoAwayOrNotBeThere) {
  ScratchFolder folder;
  const std::string image = folder.file("image.png");
  Viewer viewer;
  const std::string place = "tev:127.0.0.1:" + std::to_string(viewer.port());
  viewer.start(2);
  const ProcessResult left = run_dapple({"render", cornell, "-o", image, "--integrator", "path", "--resolution",
                                         "256x256", "--pixel-samples", "16", "--display", place},
                                        120);
  EXPECT_EQ(left.exit_code, 0) << left.output;
  EXPECT_NE(left.output.find("takes no more pictures"), std::string::npos) << left.output;
  viewer.finish();
  const ProcessResult none =
      run_dapple({"render", cornell, "-o", folder.file("none.png"), "--display", "tev:127.0.0.1:9"}, 60);
  EXPECT_EQ(none.exit_code, 4) << none.output;
  EXPECT_NE(none.output.find("does not answer at 127.0.0.1:9"), std::string::npos) << none.output;
  for (const char* wrong : {"tev:host:x", "tev:host:70000", "tev:", "tev:::1"}) {
    const ProcessResult r = run_dapple({"render", cornell, "-o", "unused.png", "--display", wrong}, 60);
    EXPECT_EQ(r.exit_code, 2) << r.output;
    EXPECT_NE(r.output.find(wrong == std::string("tev:::1") ? "IPv6" : "no place of the viewer"), std::string::npos)
        << r.output;
  }
}

}  // namespace
}  // namespace dapple::test
