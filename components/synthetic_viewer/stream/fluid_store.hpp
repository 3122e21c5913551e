#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "common/core/status.hpp"
#include "common/workspace/fluid_shape.hpp"

namespace phantom::synthetic_viewer {

/// What browsers are told of the objects' fluid (README.md, "The fluid"), made of the newest workspace when
/// it is asked for, and kept packed until the workspace is another one. Thread-safe; a call takes as long as
/// what it makes, seconds for a whole large cell. Bounded: in how many answers are made at once, in the
/// bricks that one is made of, in what it may have, and in what is kept.
class FluidStore {
 public:
  static constexpr std::size_t kMaxBricks = 16384, kMaxFaces = 500'000, kMaxCells = std::size_t{1} << 22,
                               kMaxObjects = 2048, kMaxKept = std::size_t{64} << 20;
  static constexpr int kMaxAtOnce = 2;
  /// The paths of the page that are about the fluid, as a regular expression.
  static constexpr const char* kPaths =
      R"(/fluid(?:/(shell)/(\d{1,5})/(-?\d{1,3})|/(section)/(\d{1,5})/([xyz])/(\d{1,4}))?)";

  struct Found {
    std::shared_ptr<const std::string> octets;  ///< by gzip
    std::string tag;                            ///< their hash, in quotes
    const char* type = nullptr;                 ///< of their content
  };
  using Answer = core::Expected<Found>;
  /// Returns the newest whole workspace; null: none has come yet.
  using Find = std::function<std::shared_ptr<const workspace::Workspace>()>;

  explicit FluidStore(Find find) : find_(std::move(find)) {}

  /// Returns what is asked for by one of kPaths: what there is (as JSON), the shell of an order of an
  /// object's fluid (workspace::shell_of()), or a section through it at a voxel's address along an axis
  /// (workspace::section_of()). kNotFound: there is no such object, order or address; kResourceExhausted: it
  /// is too large; kUnavailable: no workspace has come yet, or others ask at the same time.
  Answer find(const std::string& path);

 private:
  struct Content {
    std::shared_ptr<const workspace::Workspace> workspace;
    std::shared_ptr<const std::vector<workspace::ObjectFluid>> fluids;  ///< kEveryObject first
  };
  core::Expected<Content> content();
  Answer kept(const std::string& path, const Content& content);

  const Find find_;
  std::atomic<int> asking_{0};
  std::mutex mutex_;
  std::weak_ptr<const workspace::Workspace> of_;  // guarded by mutex_, as all below
  std::uint64_t version_ = 0;
  std::shared_ptr<const std::vector<workspace::ObjectFluid>> fluids_;
  std::map<std::string, Found> kept_;
  std::size_t kept_octets_ = 0;
};

}  // namespace phantom::synthetic_viewer
