// SPDX-License-Identifier: Apache-2.0
#include "dapple/base/log.h"

#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include <memory>

namespace dapple {
inline namespace base {

namespace {
spdlog::logger& logger() {
  static const std::shared_ptr<spdlog::logger> instance = [] {
    auto l = std::make_shared<spdlog::logger>("dapple", std::make_shared<spdlog::sinks::stderr_color_sink_mt>());
    l->set_pattern(isatty(STDERR_FILENO) ? "%^%l%$: %v" : "[%T] %l: %v");
    return l;
  }();
  return *instance;
}
}  // namespace

void log_info(std::string_view message) {
  logger().info("{}", message);
}
void log_warning(std::string_view message) {
  logger().warn("{}", message);
}
void log_error(std::string_view message) {
  logger().error("{}", message);
}

void set_log_level(int level) {
  logger().set_level(level <= 0 ? spdlog::level::err : level == 1 ? spdlog::level::warn : spdlog::level::info);
}

}  // namespace base
}  // namespace dapple
