#pragma once

#include <cstdint>
#include <nlohmann/json_fwd.hpp>
#include <span>

#include "common/core/status.hpp"
#include "common/diagnostics/type.hpp"

namespace phantom::diagnostics {

struct DecodeOptions {
  std::size_t most_octets = 32;  ///< octets of a sequence that are shown; 0: all
};

/// Returns a sample as JSON, with members in the order of the IDL. `payload` is plain CDR (XCDR1) with its
/// encapsulation header of four octets, of either byte order.
///   - an enum is the name of its literal; a value without a literal is "17 (no literal of MotionClass)"
///   - NaN and infinities, which JSON lacks, are the strings "NaN", "Infinity", "-Infinity"
///   - a float is the shortest decimal that reads back as the same value
///   - octets are one string of hexadecimal digits, cut with an ellipsis and their number
///   - text that is not UTF-8 has each offending octet as U+FFFD
/// A payload that ends early, claims more than it has, exceeds a bound or continues after the last member
/// gives an error that names the member, the octet where it begins and what is wrong. Never reads beyond
/// `payload`; memory is bounded by a multiple of its size. Not real-time safe. Thread-safe.
core::Expected<nlohmann::ordered_json> decode(const Type& type, std::span<const std::uint8_t> payload,
                                              const DecodeOptions& options = {});

/// Returns octets as hexadecimal digits, "28b52ffd… (12345 octets)" if there are more than `most`; 0: all.
std::string octets_text(std::span<const std::uint8_t> octets, std::size_t most);

/// Returns the key members of a sample that was decoded from `type`: "component_name=wva_server, host=desk";
/// empty if the type has no key.
std::string instance_name(const Type& type, const nlohmann::ordered_json& sample);

}  // namespace phantom::diagnostics
