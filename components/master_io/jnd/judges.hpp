#pragma once

#include <iosfwd>
#include <string>
#include <utility>

#include "common/simulation/drag_observer.hpp"
#include "components/master_io/jnd/measurement.hpp"

namespace phantom::master_io {

/// A person who is asked in lines of text.
class AskedPerson : public DragJudge {
 public:
  /// `in`: file descriptor of the answers. `out` must outlive this.
  AskedPerson(std::string joint_name, int in, std::ostream& out)
      : joint_name_(std::move(joint_name)), in_(in), out_(out) {}

  void begin(int trial, int interval) override;
  /// Asks again until the answer is 1 or 2. Errors: `q`, the end of `in`, a stop of this process.
  core::Expected<bool> calls_first_greater(double first, double second) override;

 private:
  core::Expected<std::string> line();

  std::string joint_name_;
  int in_;
  std::ostream& out_;
  std::string unread_;
};

/// A simulated observer with a known Weber fraction.
class SimulatedJudge : public DragJudge {
 public:
  explicit SimulatedJudge(const simulation::DragObserverParameters& parameters) : observer_(parameters) {}

  void begin(int, int) override {}
  core::Expected<bool> calls_first_greater(double first, double second) override {
    return observer_.calls_first_greater(first, second);
  }

 private:
  simulation::DragObserver observer_;
};

}  // namespace phantom::master_io
