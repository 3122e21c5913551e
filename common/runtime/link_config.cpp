#include "common/runtime/link_config.hpp"

namespace phantom::runtime {

teleop::LinkTiming read_link(const ConfigReader& section) {
  teleop::LinkTiming link;
  link.staleness_s = section.number("staleness_s", link.staleness_s, {0.002, 2, "s"});
  link.round_trip_limit_s = section.number("round_trip_limit_s", link.round_trip_limit_s, {0.002, 10, "s"});
  link.align_hold_s = section.number("align_hold_s", link.align_hold_s, {0, 5, "s"});
  link.recovery_s = section.number("recovery_s", link.recovery_s, {0, 60, "s"});
  return link;
}

}  // namespace phantom::runtime
