#include "common/dds/stamp.hpp"

namespace phantom::dds {

msg::Stamp Stamper::next() {
  msg::Stamp stamp;
  stamp.sequence_number(++sequence_number_);
  stamp.monotonic_ns(core::monotonic_ns());
  stamp.utc_ns(core::utc_ns());
  stamp.session(session_);
  return stamp;
}

msg::Echo echo_of(const msg::Stamp& stamp) {
  msg::Echo echo;
  echo.sequence_number(stamp.sequence_number());
  echo.monotonic_ns(stamp.monotonic_ns());
  echo.session(stamp.session());
  return echo;
}

core::Nanoseconds answered_ns(const msg::Echo& echo, std::uint64_t own_session,
                              core::Nanoseconds received_ns) noexcept {
  const bool ours = echo.session() == own_session && echo.sequence_number() != 0 && echo.monotonic_ns() > 0 &&
                    echo.monotonic_ns() <= received_ns;
  return ours ? echo.monotonic_ns() : 0;
}

bool SequenceGuard::accept(const msg::Stamp& stamp) noexcept {
  const std::uint64_t number = stamp.sequence_number();
  if (number == 0) return false;
  if (stamp.session() != session_) {
    session_ = stamp.session();
    last_ = number;
    return true;
  }
  if (number <= last_) return false;
  lost_ += number - last_ - 1;
  last_ = number;
  return true;
}

}  // namespace phantom::dds
