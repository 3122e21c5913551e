#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <utility>

#include "common/core/clock.hpp"
#include "common/core/sample_id.hpp"

namespace phantom::messages {

/// x, y, z. Trivially copyable, as core::Snapshot requires.
using Vector3 = std::array<double, 3>;

inline Vector3 vector_of(const Eigen::Vector3d& v) noexcept { return {v.x(), v.y(), v.z()}; }
inline Eigen::Vector3d eigen(const Vector3& v) noexcept { return {v[0], v[1], v[2]}; }

/// The newest valid sample of a topic.
template <class Sample>
struct Received : Sample {
  core::Nanoseconds received_ns = 0;  ///< on this host's monotonic clock; 0: none received yet

  Received() = default;
  Received(Sample sample, core::Nanoseconds at_ns) : Sample(std::move(sample)), received_ns(at_ns) {}
};

/// The newest valid sample of a process that answers this process's samples.
template <class Sample>
struct Answer : Received<Sample> {
  /// When this process made the sample that this one answers; 0: it answers none of this process.
  core::Nanoseconds answers_ns = 0;
  bool echoes_other_session = false;  ///< it answers another process that runs in place of this one

  Answer() = default;
  /// `echo`: the sample's echo. `own_session`: the session that the echo must name to count as an answer.
  Answer(const Sample& sample, const core::SampleId& echo, core::Nanoseconds at_ns, std::uint64_t own_session)
      : Received<Sample>(sample, at_ns),
        answers_ns(core::answered_ns(echo, own_session, at_ns)),
        echoes_other_session(echo.session != 0 && echo.session != own_session) {}
};

}  // namespace phantom::messages
