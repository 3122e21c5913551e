#pragma once

#include <array>
#include <bitset>
#include <cstdint>
#include <optional>
#include <span>

#include "common/wire/rtps.hpp"

namespace phantom::wire {

/// Octets by which a message may grow in FragmentReassembler::rewrite(): 12 for each DATA, of at least 28
/// octets.
inline constexpr std::size_t kMaxGrown = 65536 / 28 * 12;

/// Keeps Fast DDS 3.1 from ending the process by an assertion (StatelessReader::process_data_frag_msg): a
/// best-effort reader that lacks a fragment of a sample, gets a later sample in one DATA and then a fragment
/// of a third. A DATA that comes while a fragment of its writer is missing is turned into a DATA_FRAG of one
/// fragment (OMG DDSI-RTPS 2.5, 9.4.5.4 and 9.4.5.5), which Fast DDS takes for what follows a lost sample.
/// Writers with keys are left alone: a DATA that disposes of an instance has no form in fragments.
/// Thread safety: none. Real-time safe: yes; all memory is its own.
class FragmentReassembler {
 public:
  /// Writers of which it knows at a time that a fragment is missing; of further ones the oldest is forgotten.
  static constexpr std::size_t kMaxWriters = 64;

  /// Whether a sample of some writer of this participant lacks a fragment: only then may a message of it that
  /// holds no fragments have to be rewritten.
  bool awaits(const GuidPrefix& participant) const;

  /// Goes through an RTPS message in which check_message() has found no fault. Returns the octets of `into`
  /// that hold what is to be read in its place; none: the message itself. `into` has room for the message and
  /// kMaxGrown more.
  std::span<std::uint8_t> rewrite(std::span<const std::uint8_t> message, std::span<std::uint8_t> into);

 private:
  /// Samples of more fragments than this count as never complete.
  static constexpr std::size_t kMaxFragments = 4096;
  struct Pending {
    std::optional<Guid> writer;  ///< none: a free place
    std::int64_t sequence = 0;
    std::size_t fragments = 0;
    std::bitset<kMaxFragments> heard;
  };
  struct Fragment {
    Guid writer;
    std::int64_t sequence = 0;
    std::size_t first = 1, count = 1, fragments = 1;
  };

  Pending* of(const Guid& writer);
  void note(const Fragment& fragment);
  bool ends_pending(const Guid& writer, std::int64_t sequence);
  void forget(Pending& pending);

  std::array<Pending, kMaxWriters> pending_;
  std::size_t pending_count_ = 0, next_ = 0;
};

}  // namespace phantom::wire
