#pragma once

#include <sys/types.h>

#include <string>
#include <vector>

#include "components/workspace_survey/head/head_protocol.hpp"

namespace phantom::workspace_survey {

/// A pan–tilt range head that can be steered. Calls block until the head answers. One thread.
class SteeredHead {
 public:
  virtual ~SteeredHead() = default;
  virtual const HeadDescription& description() const = 0;
  /// Turns the head; returns where it stands (range 0).
  virtual core::Expected<survey::Reading> aim(double pan_rad, double tilt_rad) = 0;
  /// Takes several readings where it stands.
  virtual core::Expected<std::vector<survey::Reading>> measure(int readings) = 0;
};

/// A head whose driver is a process of its own (head_protocol.hpp). Every reply is checked; a driver that
/// ends, is silent for longer than the timeout, or says what is not allowed is an error of that call, which
/// names the driver, request and fault. Replies to earlier requests that timed out are left out. The driver
/// is asked to end by the end of its input, and ended after a second.
class HeadDriver final : public SteeredHead {
 public:
  /// Starts `command` by the shell, and asks what it drives. `head`: whose ranges are allowed. Throws
  /// core::MissingError if it does not answer, core::ConfigError if it answers wrongly.
  HeadDriver(std::string command, const survey::RangeHead& head, double timeout_s);
  ~HeadDriver() override;
  HeadDriver(const HeadDriver&) = delete;
  HeadDriver& operator=(const HeadDriver&) = delete;

  const HeadDescription& description() const override { return description_; }
  core::Expected<survey::Reading> aim(double pan_rad, double tilt_rad) override;
  core::Expected<std::vector<survey::Reading>> measure(int readings) override;

 private:
  void start();
  core::Expected<std::string> ask(HeadRequest request);
  core::Status send(const std::string& line, double until_s) const;
  core::Expected<std::string> next_line(double until_s);
  core::Status error(const HeadRequest& request, const core::Status& why) const;
  std::string end_of_driver();

  std::string command_;
  survey::RangeHead head_;
  double timeout_s_;
  pid_t process_ = -1;
  int to_driver_ = -1, from_driver_ = -1;
  std::string received_;  // what came after the last whole line
  std::uint64_t next_id_ = 1;
  HeadDescription description_;
  survey::Reading pointing_;
  bool has_aimed_ = false;
};

}  // namespace phantom::workspace_survey
