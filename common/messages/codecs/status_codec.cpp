#include "common/messages/codecs/status_codec.hpp"

#include "common/messages/codecs/fields_codec.hpp"

namespace phantom::messages {
namespace {

#include "phantom_contract/status_fields.inc"

/// Returns why the status names no component; empty if it does.
std::string refusal(const ComponentStatus& status) {
  return status.component.empty() ? "component_name is empty; allowed: the component's name" : "";
}

}  // namespace

#include "phantom_contract/status_codec.inc"

}  // namespace phantom::messages
