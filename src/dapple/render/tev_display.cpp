// SPDX-License-Identifier: Apache-2.0
#include "dapple/render/tev_display.h"

#include <fcntl.h>
#include <netdb.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <bit>
#include <cerrno>
#include <charconv>
#include <chrono>
#include <cstring>
#include <memory>
#include <utility>

#include "dapple/base/error.h"
#include "dapple/base/log.h"

namespace dapple::render {

namespace {

using Clock = std::chrono::steady_clock;
constexpr std::chrono::seconds patience{5};  // with a channel, and with connecting
constexpr std::chrono::milliseconds slice{50};

enum class Operation : uint8_t { update_image = 3, create_image = 4 };

/// What stands in a packet behind its length.
class Payload {
 public:
  explicit Payload(Operation operation) { add_byte(uint8_t(operation)); }
  void add_byte(uint8_t v) { bytes.push_back(char(v)); }
  void add(uint32_t v) {
    for (int i = 0; i < 4; ++i) add_byte(uint8_t(v >> (8 * i)));
  }
  void add(float v) { add(std::bit_cast<uint32_t>(v)); }
  void add(const std::string& text) { bytes.append(text.c_str(), text.size() + 1); }

  std::string bytes;
};

// False after the deadline, or when stopped.
bool wait_for(int socket, short events, Clock::time_point deadline, const StopToken& stop) {
  while (!stop.stopped() && Clock::now() < deadline) {
    pollfd p{socket, events, 0};
    if (poll(&p, 1, int(slice.count())) > 0) return true;
  }
  return false;
}

// -1 where nobody listens; errno says why.
int connect_to(const addrinfo& address, const StopToken& stop) {
  const int socket =
      ::socket(address.ai_family, address.ai_socktype | SOCK_CLOEXEC | SOCK_NONBLOCK, address.ai_protocol);
  if (socket < 0) return -1;
  int error = connect(socket, address.ai_addr, address.ai_addrlen) == 0 ? 0 : errno;
  if (error == EINPROGRESS) {
    error = ETIMEDOUT;
    socklen_t size = sizeof error;
    if (wait_for(socket, POLLOUT, Clock::now() + patience, stop))
      getsockopt(socket, SOL_SOCKET, SO_ERROR, &error, &size);
  }
  if (error == 0) return socket;
  close(socket);
  errno = error;
  return -1;
}

}  // namespace

TevAddress::TevAddress(const std::string& text) {
  if (text == "tev") return;
  const std::string where = text.substr(4);
  const size_t colon = where.rfind(':');
  host = where.substr(0, colon);
  if (colon != std::string::npos) port = where.substr(colon + 1);
  if (host.find(':') != std::string::npos)
    throw UsageError("\"" + text + "\": addresses of IPv6 are not known; name the host, as in tev:HOST:PORT");
  uint16_t number = 0;
  const auto [end, error] = std::from_chars(port.data(), port.data() + port.size(), number);
  if (host.empty() || error != std::errc() || end != port.data() + port.size() || number == 0)
    throw UsageError("\"" + text + "\" is no place of the viewer; expected tev, tev:HOST or tev:HOST:PORT");
}

TevDisplay::TevDisplay(const TevAddress& address, std::string image_name, StopToken stop)
    : address_(address.to_string()), name_(std::move(image_name)), stop_(stop) {
  addrinfo hints{};
  hints.ai_socktype = SOCK_STREAM;
  addrinfo* found = nullptr;
  const int error = getaddrinfo(address.host.c_str(), address.port.c_str(), &hints, &found);
  const std::unique_ptr<addrinfo, void (*)(addrinfo*)> list(found, [](addrinfo* a) {
    if (a) freeaddrinfo(a);
  });
  for (const addrinfo* a = error == 0 ? found : nullptr; a && socket_ < 0; a = a->ai_next)
    socket_ = connect_to(*a, stop_);
  if (socket_ < 0)
    throw IoError("the viewer tev does not answer at " + address_ + ": " +
                  (error != 0 ? gai_strerror(error) : std::strerror(errno)));
}

TevDisplay::~TevDisplay() {
  leave();
}

void TevDisplay::leave() {
  if (const int socket = socket_.exchange(-1); socket >= 0) close(socket);
}

// After a part of a packet nothing else can be sent: one that is given up ends the connection.
void TevDisplay::send(const std::string& payload) {
  if (socket_ < 0) return;
  const Clock::time_point deadline = Clock::now() + patience;
  if (payload.size() > UINT32_MAX - 4) {
    log_warning("the viewer tev takes no channel of more than 4 GB");
    return leave();
  }
  Payload length(Operation::update_image);
  length.bytes.clear();
  length.add(uint32_t(payload.size() + 4));
  for (const std::string_view part : {std::string_view(length.bytes), std::string_view(payload)})
    for (size_t sent = 0; sent < part.size();) {
      if (stop_.stopped()) return leave();
      const ssize_t n = ::send(socket_, part.data() + sent, part.size() - sent, MSG_NOSIGNAL);
      int error = n < 0 ? errno : 0;
      if (n > 0) sent += size_t(n);
      if (error == EAGAIN || error == EWOULDBLOCK)
        error = wait_for(socket_, POLLOUT, deadline, stop_) || stop_.stopped() ? 0 : ETIMEDOUT;
      if (sent < part.size() && Clock::now() >= deadline) error = ETIMEDOUT;
      if (error == 0 || error == EINTR) continue;
      log_warning("the viewer tev at " + address_ + " takes no more pictures: " + std::strerror(error));
      return leave();
    }
}

void TevDisplay::show(const image::OutputImage& picture) {
  if (!is_open() || stop_.stopped()) return;
  const int width = picture.display_width > 0 ? picture.display_width : picture.width;
  const int height = picture.display_height > 0 ? picture.display_height : picture.height;
  std::vector<std::string> channels;
  for (const image::ImageLayer& layer : picture.layers)
    channels.insert(channels.end(), layer.channels.begin(), layer.channels.end());
  if (channels != channels_ || width != width_ || height != height_) {
    Payload create(Operation::create_image);
    create.add_byte(channels_.empty());  // whether the viewer turns to it
    create.add(name_);
    create.add(uint32_t(width));
    create.add(uint32_t(height));
    create.add(uint32_t(channels.size()));
    for (const std::string& channel : channels) create.add(channel);
    send(create.bytes);
    channels_ = channels, width_ = width, height_ = height;
  }
  for (const image::ImageLayer& layer : picture.layers)
    for (size_t c = 0; c < layer.channels.size() && is_open(); ++c) {
      Payload update(Operation::update_image);
      update.bytes.reserve(layer.pixels.size() / layer.channels.size() * 4 + 256);
      update.add_byte(0);
      update.add(name_);
      update.add(layer.channels[c]);
      for (const int n : {picture.origin.x, picture.origin.y, picture.width, picture.height}) update.add(uint32_t(n));
      for (size_t i = c; i < layer.pixels.size(); i += layer.channels.size()) update.add(layer.pixels[i]);
      send(update.bytes);
    }
}

}  // namespace dapple::render
