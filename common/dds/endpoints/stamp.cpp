#include "common/dds/endpoints/stamp.hpp"

namespace phantom::dds {

msg::Stamp Stamper::next() {
  msg::Stamp stamp;
  stamp.sequence_number(++sequence_number_);
  stamp.monotonic_ns(core::monotonic_ns());
  stamp.utc_ns(core::utc_ns());
  stamp.session(session_);
  return stamp;
}

core::SampleId id_of(const msg::Stamp& stamp) noexcept {
  return {stamp.sequence_number(), stamp.monotonic_ns(), stamp.session()};
}
core::SampleId id_of(const msg::Echo& echo) noexcept {
  return {echo.sequence_number(), echo.monotonic_ns(), echo.session()};
}

msg::Echo echo_of(const core::SampleId& id) noexcept {
  msg::Echo echo;
  echo.sequence_number(id.sequence_number);
  echo.monotonic_ns(id.monotonic_ns);
  echo.session(id.session);
  return echo;
}

bool SequenceGuard::accept(const msg::Stamp& stamp) noexcept {
  const auto follows = [](std::uint64_t number, std::uint64_t one) {
    return number > one && number - one <= kMaxStep;
  };
  const std::uint64_t number = stamp.sequence_number();
  if (number == 0) return false;
  const bool known = stamp.session() == session_ && last_ != 0;
  if (known && follows(number, last_)) {
    lost_ += number - last_ - 1;
  } else if (known) {
    run_ = follows(number, refused_) ? run_ + 1 : 1;
    refused_ = number;
    if (run_ < kRun) return false;
  }
  session_ = stamp.session();
  last_ = number;
  run_ = 0;
  return true;
}

}  // namespace phantom::dds
