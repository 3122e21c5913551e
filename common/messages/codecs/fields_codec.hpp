#pragma once

// The parts of a topic's codec. Each message has one list of its fields, which idl/contract.py makes from the
// IDL,
//
//     constexpr auto kPercept = [](auto& codec, auto& m, auto& s) {
//       codec.number("speed_m_s", m.speed_m_s(), s.speed_m_s, 0.0, 100.0);
//       …
//     };
//
// A Decoder runs it from message to sample and checks every field; an Encoder runs it from sample to message.

#include <algorithm>
#include <cstdint>
#include <initializer_list>
#include <limits>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "common/core/errors.hpp"
#include "common/core/printable.hpp"
#include "common/core/sample_id.hpp"
#include "common/core/status.hpp"
#include "common/dds/endpoints/stamp.hpp"
#include "common/geometry/pose.hpp"
#include "common/messages/arm_bounds.hpp"
#include "common/messages/received.hpp"
#include "common/workspace/grid.hpp"

namespace phantom::messages {

/// Bound of a range without a limit: every finite value is allowed.
inline constexpr double kAnyNumber = std::numeric_limits<double>::max();
/// Larger than any cell: a place beyond it is an error.
inline constexpr double kFarthest_m = 1e4;

/// Reads a message's fields into a sample. result() reports the first field that is not finite, is out of
/// range or does not fit the arm; the sample must then not be used.
class Decoder {
 public:
  explicit Decoder(const ArmBounds& arm) : arm_(arm) {}

  void stamp(const msg::Stamp& from, core::SampleId& to);
  void echo(const msg::Echo& from, core::SampleId& to) { to = dds::id_of(from); }
  /// Reads an enumeration of `count` values and checks it, because values arrive from the network unchecked.
  /// The list in the IDL and `To` (or false, true) must have the same order (enumerators_agree()).
  template <class From, class To>
  void enumeration(const char* field, const From& from, To& to, int count) {
    static_assert(std::is_enum_v<From>);
    to = static_cast<To>(from);
    in_range(field, static_cast<double>(from), 0.0, count - 1.0);
  }
  void joint_count(std::uint32_t from, std::uint32_t& to);
  void link(std::uint32_t from, std::uint32_t& to);
  /// Reads one value per joint; call it after joint_count(). Ignores values beyond the joints.
  void joints(const char* field, const core::JointArray& from, core::JointArray& to,
              double least = -kAnyNumber);
  /// As joints(), and checks that the values are near the joints' limits.
  void positions(const char* field, const core::JointArray& from, core::JointArray& to);
  template <class To>
  void place(const char* field, const msg::Vector3& from, To& to) {
    vector(field, from, to, kFarthest_m);
  }
  void place(const char* field, const msg::Vector3& from, workspace::VoxelSize& to);
  /// Reads a vector whose coordinates are each within ± `most`.
  template <class To>
  void vector(const char* field, const msg::Vector3& from, To& to, double most) {
    to[0] = from.x();
    to[1] = from.y();
    to[2] = from.z();
    for (const double coordinate : to) in_range(field, coordinate, -most, most);
  }
  void pose(const char* field, const msg::Pose& from, geometry::Pose& to);
  /// As pose(), into arrays, the rotation by columns, and with a position within ± `most_m`.
  void placement(const char* field, const msg::Pose& from, Vector3& position_m, std::array<double, 9>& R,
                 double most_m);
  template <class From, class To>
  void number(const char* field, const From& from, To& to, double least = -kAnyNumber,
              double most = kAnyNumber) {
    to = static_cast<To>(from);
    in_range(field, static_cast<double>(from), least, most);
  }
  /// Reads the edge of cubes.
  void number(const char* field, double from, workspace::VoxelSize& to, double least, double most);
  /// Reads a field that may have any value: a flag, a number of the whole range, a text. A span points into
  /// the message.
  template <class From, class To>
  void any(const From& from, To& to) {
    if constexpr (requires { from.c_str(); }) {
      to = from.c_str();
    } else {
      to = from;
    }
  }
  /// Reads a list of `least` to `most` numbers; `unit`: what they are, for the error. Copies nothing of a
  /// message that is refused.
  template <class From, class To>
  void values(const char* field, const char* unit, const std::vector<From>& from, To& to, std::size_t least,
              std::size_t most) {
    if (counts(field, unit, from.size(), least, most) && why_.empty()) to = from;
  }
  /// Reads a text that must not be cut, for example a name that identifies something.
  template <class From>
  void whole_text(const char*, const From& from, std::string& to) {
    any(from, to);
  }
  template <class From>
  void whole_or_empty(const char*, const From& from, std::string& to) {
    any(from, to);
  }
  /// Reads a name as whole_text() does. Refuses one that is not core::is_printable(), because names stand in
  /// logs and on terminals.
  template <class From>
  void name(const char* field, const From& from, std::string& to) {
    any(from, to);
    if (!core::is_printable(to))
      refuse(std::string(field) + " has control characters; allowed: one line of text");
  }
  /// Reads a list of at most `most` items into a vector or a bounded list.
  template <class From, class To, class Fields>
  void list(const char* field, const std::vector<From>& from, To& to, const Fields& fields,
            std::size_t most) {
    if (!counts(field, "items", from.size(), 0, most)) return;
    to.resize(from.size());
    for (std::size_t i = 0; i < to.size(); ++i) fields(*this, from[i], to[i]);
  }

  void refuse(std::string why) {
    if (why_.empty()) why_ = std::move(why);
  }
  core::Status result() const {
    return why_.empty() ? core::Status::ok() : core::Status::invalid_argument(why_);
  }

 private:
  bool in_range(const char* field, double value, double least, double most);
  bool counts(const char* field, const char* unit, std::size_t count, std::size_t least, std::size_t most);
  Eigen::Matrix3d rotation(const char* field, const msg::Pose& from);
  std::string joint_text(const char* field, std::size_t joint) const;

  const ArmBounds& arm_;
  std::uint32_t joint_count_ = 0;
  std::string why_;
};

/// Writes a sample's fields into a message, without checks but that of whole_text(). Of the stamp it sets
/// only the fields that identify the sample; the writer completes it (dds::Stamper).
class Encoder {
 public:
  void stamp(msg::Stamp& to, const core::SampleId& from);
  void echo(msg::Echo& to, const core::SampleId& from) { to = dds::echo_of(from); }
  template <class To, class From>
  void enumeration(const char*, To& to, const From& from, int) {
    to = static_cast<To>(from);
  }
  void joint_count(std::uint32_t& to, std::uint32_t from) { to = from; }
  void link(std::uint32_t& to, std::uint32_t from) { to = from; }
  void joints(const char*, core::JointArray& to, const core::JointArray& from, double = 0.0) { to = from; }
  void positions(const char*, core::JointArray& to, const core::JointArray& from) { to = from; }
  template <class From>
  void place(const char* field, msg::Vector3& to, const From& from) {
    vector(field, to, from, kFarthest_m);
  }
  void place(const char* field, msg::Vector3& to, const workspace::VoxelSize& from) {
    place(field, to, from.sides_m());
  }
  template <class From>
  void vector(const char*, msg::Vector3& to, const From& from, double) {
    to.x(from[0]);
    to.y(from[1]);
    to.z(from[2]);
  }
  void placement(const char* field, msg::Pose& to, const Vector3& position_m, const std::array<double, 9>& R,
                 double);
  void pose(const char*, msg::Pose& to, const geometry::Pose& from);
  template <class To, class From>
  void number(const char*, To& to, const From& from, double = 0.0, double = 0.0) {
    to = static_cast<To>(from);
  }
  void number(const char*, double& to, const workspace::VoxelSize& from, double, double) {
    to = from.reference_m();
  }
  /// Cuts a text that is longer than the IDL allows.
  template <class To, class From>
  void any(To& to, const From& from) {
    if constexpr (std::is_assignable_v<To&, const From&>) {
      to = from;
    } else {
      to.assign(from.begin(), from.end());
    }
  }
  template <class To, class From>
  void values(const char*, const char*, To& to, const From& from, std::size_t, std::size_t) {
    any(to, from);
  }
  /// Leaves out a text that is longer than the IDL allows, for example an address, which would lead nowhere.
  template <class To>
  void whole_or_empty(const char*, To& to, const std::string& from) {
    to = from.size() > To::max_size ? std::string() : from;
  }
  /// Throws core::ConfigError for a text that is longer than the IDL allows.
  template <class To>
  void whole_text(const char* field, To& to, const std::string& from) {
    if (from.size() > To::max_size)
      throw core::ConfigError(std::string(field) + " has " + std::to_string(from.size()) +
                              " bytes; allowed: at most " + std::to_string(To::max_size));
    to = from;
  }
  template <class To>
  void name(const char* field, To& to, const std::string& from) {
    whole_text(field, to, from);
  }
  /// Leaves out the items beyond the `most` that the IDL allows.
  template <class To, class From, class Fields>
  void list(const char*, std::vector<To>& to, const From& from, const Fields& fields, std::size_t most) {
    to.resize(std::min(most, from.size()));
    for (std::size_t i = 0; i < to.size(); ++i) fields(*this, to[i], from[i]);
  }
};

/// Reads a message into a sample by a list of fields. If it returns an error, the sample holds what could be
/// read and must not be used as a whole.
template <class Fields, class Message, class Sample>
core::Status decode(const Fields& fields, const Message& message, const ArmBounds& arm, Sample& sample) {
  Decoder decoder(arm);
  fields(decoder, message, sample);
  return decoder.result();
}
/// Returns `status`, or what `refusal` says against a sample that could be decoded: why its fields do not fit
/// together; empty if they do.
template <class Sample, class Refusal>
core::Status judged(core::Status status, const Sample& sample, const Refusal& refusal) {
  if (!status) return status;
  const std::string why = refusal(sample);
  return why.empty() ? status : core::Status::invalid_argument(why);
}
/// Returns the sample that `read` reads from a message, or why the message cannot be used.
template <class Sample, class Message>
core::Expected<Sample> read_whole(const Message& message, const ArmBounds& arm) {
  Sample sample;
  if (core::Status status = read(message, sample, arm); !status) return status;
  return sample;
}
template <class Message, class Fields, class Sample>
Message encoded(const Fields& fields, const Sample& sample) {
  Encoder encoder;
  Message message;
  fields(encoder, message, sample);
  return message;
}

/// Returns whether the enumerators of each pair travel as the same number.
template <class InMessage, class InSample>
constexpr bool enumerators_agree(std::initializer_list<std::pair<InMessage, InSample>> pairs) {
  for (const auto& [a, b] : pairs) {
    if (static_cast<int>(a) != static_cast<int>(b)) return false;
  }
  return true;
}

}  // namespace phantom::messages
