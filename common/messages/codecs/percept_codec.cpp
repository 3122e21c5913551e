#include "common/messages/codecs/percept_codec.hpp"

#include <algorithm>
#include <cmath>

#include "common/messages/codecs/fields_codec.hpp"

namespace phantom::messages {
namespace {

#include "phantom_contract/percept_fields.inc"

// Each returns why a sample's fields do not fit together; empty if they do.

std::string refusal(const DragField& field) {
  if (field.mode != teleop::DragMode::kCoupled) return "";
  const auto used = static_cast<std::ptrdiff_t>(field.joint_count * (field.joint_count + 1) / 2);
  const auto& entries = field.drag.coupled;
  const auto finite = [](double d) { return std::isfinite(d); };
  return std::all_of(entries.begin(), entries.begin() + used, finite)
             ? ""
             : "an entry of the drag matrix `coupled` is not finite";
}

std::string refusal(const SensingCommand& command) {
  const bool names_object = !command.object.empty() || command.id != 0;
  if (command.request != SensingRequest::kAllowContact || names_object) return "";
  return "object is empty and id is 0; allowed: a name, or an id of 1 to 65534";
}

}  // namespace

#include "phantom_contract/percept_codec.inc"

}  // namespace phantom::messages
