#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "components/synthetic_viewer/scene/scene_base.hpp"
#include "components/synthetic_viewer/stream/scene_message_log.hpp"

namespace phantom::synthetic_viewer {

/// Says in the messages of the scene stream (README.md) what the pictures show: the same bodies and aids,
/// without a camera. Pure: states in, messages out. One thread.
class SceneEncoder {
 public:
  /// `config` must outlive this. `cell`: its name.
  SceneEncoder(const SceneConfig& config, double rate_Hz, std::string cell)
      : config_(config), rate_Hz_(rate_Hz), cell_(std::move(cell)) {}

  /// Takes what the drawing thread knows now.
  void take(std::shared_ptr<const SceneBase> base);
  /// Puts what has changed onto board(), with the newest samples, which a recorded moment does without. Does
  /// nothing before take(). `now_ns`: CLOCK_MONOTONIC.
  void compose(const LiveSamples& live, core::Nanoseconds now_ns);

  /// The messages but `poses`.
  SceneMessageLog& board() { return board_; }
  /// Returns the newest `poses`; null: none yet. It is another one than before only if something moves, or
  /// the last one is 0.2 s old.
  const SceneMessageLog::Content& poses() const { return poses_; }

 private:
  void put_cell();
  // at_ns: of the moment that is shown, by its clock
  void put_items(core::Nanoseconds at_ns);
  void put_view(core::Nanoseconds at_ns);
  void put_paint(core::Nanoseconds now_ns);
  void put_poses(core::Nanoseconds at_ns, core::Nanoseconds now_ns);
  std::string marks(std::size_t& count, const Compositor::Moment& moment) const;
  std::string item_text(const SceneItem& item, const std::string& name) const;

  const SceneConfig& config_;
  const double rate_Hz_;  ///< of poses, at most
  const std::string cell_;
  std::shared_ptr<const SceneBase> base_;
  std::optional<Compositor> compositor_;  // of base_
  ViewerState state_;                     // of base_, with the newest samples
  bool new_base_ = false, new_paint_ = false;
  struct KnownItem {
    SceneItem item;  // its mesh may be gone
    std::uint64_t mesh_hash = 0;
    std::string name;
  };
  std::map<std::uint64_t, KnownItem> items_;              // as they were told
  std::optional<std::pair<LocalizedText, bool>> banner_;  // as it was told, and whether it is an alarm
  core::Nanoseconds told_skin_ns_ = 0, paint_due_ns_ = 0;
  std::uint32_t paint_number_ = 0, poses_number_ = 0;
  core::Nanoseconds poses_ns_ = 0;
  std::string poses_content_;  // but number, time and ages
  SceneMessageLog board_;
  SceneMessageLog::Content poses_;
};

}  // namespace phantom::synthetic_viewer
