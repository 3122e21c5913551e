#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "common/runtime/process/command_line.hpp"
#include "common/runtime/process/process.hpp"
#include "components/synthetic_viewer/config.hpp"
#include "components/synthetic_viewer/page/web_server.hpp"
#include "components/synthetic_viewer/review/review.hpp"
#include "components/synthetic_viewer/stream/scene_feed.hpp"
#include "components/synthetic_viewer/viewer_loop.hpp"

namespace phantom::synthetic_viewer {

/// Arguments of `synthetic_viewer review`.
struct ReviewArguments {
  std::vector<std::filesystem::path> files;  ///< MCAP files, or folders of them
  std::filesystem::path cell;                ///< empty: the topology's
  int port = -1;                             ///< of the page; −1: as configured
};

/// Declares the command with its options.
runtime::Command add_review_command(runtime::Command app, ReviewArguments& arguments);

/// A recording on the operator's page: drawing thread and page, wired to it instead of to topics.
class ReviewedSession {
 public:
  /// Begins to serve and to draw. `review` and `config` must outlive it. Throws core::MissingError for a port
  /// that is taken.
  ReviewedSession(Review& review, const ViewerConfig& config, const runtime::CellConfig& cell,
                  robot::SerialArm arm, std::vector<LinkMeshData> arm_meshes);
  /// Returns false once the drawing has ended by itself.
  bool running() const { return viewer_.running(); }
  std::string url() const { return server_.url(); }
  /// Ends the drawing. Throws core::MissingError if it ended for want of OpenGL.
  void finish() { viewer_.finish(server_.url()); }

 private:
  PageContent& wired(Review& review);

  Inbox inbox_;
  PageContent content_;
  ViewerLoop viewer_;
  SceneFeed scene_;
  WebServer server_;
};

/// Shows a recording on the operator's page until a stop is requested: its views, numbers, alerts and plots,
/// at any of its moments. It takes part in no DDS domain. Returns an exit code. Throws core::MissingError for
/// files that do not exist, a port that is taken or without OpenGL, core::ConfigError for files that are no
/// recordings or do not fit the cell.
int run_review(const ReviewArguments& arguments, ViewerConfig config, const runtime::ProcessOptions& options);

}  // namespace phantom::synthetic_viewer
