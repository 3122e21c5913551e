#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>

#include "common/core/clock.hpp"
#include "common/core/sample_id.hpp"

namespace phantom::messages {

/// x, y, z; trivially copyable, as what passes core::Snapshot must be.
using Vector3 = std::array<double, 3>;

inline Vector3 vector_of(const Eigen::Vector3d& v) noexcept { return {v.x(), v.y(), v.z()}; }

/// The newest valid sample of a topic.
template <class Sample>
struct Received : Sample {
  core::Nanoseconds received_ns = 0;  ///< this host's monotonic clock; 0: none yet

  Received() = default;
  Received(const Sample& sample, core::Nanoseconds at_ns) : Sample(sample), received_ns(at_ns) {}
};

/// The newest valid sample of who answers what this process sends.
template <class Sample>
struct Answer : Received<Sample> {
  core::Nanoseconds answers_ns = 0;  ///< when our own sample was made that it goes back to; 0: none of ours
  bool answers_another = false;      ///< it goes back to another process in our place

  Answer() = default;
  /// `echo`: of the sample; `own_session`: whose stamps it must name to count as an answer.
  Answer(const Sample& sample, const core::SampleId& echo, core::Nanoseconds at_ns, std::uint64_t own_session)
      : Received<Sample>(sample, at_ns),
        answers_ns(core::answered_ns(echo, own_session, at_ns)),
        answers_another(echo.session != 0 && echo.session != own_session) {}
};

}  // namespace phantom::messages
