#pragma once

#include <memory>

#include "common/core/health.hpp"
#include "common/core/network.hpp"
#include "components/phantom_sensing/sensing_loop.hpp"
#include "components/phantom_sensing/workspace_keeper.hpp"

namespace phantom::phantom_sensing {

/// Everything that this component says and hears over DDS: slave_state, workspace_brick and workspace_version
/// in; drag_field, percept, hit_alert and component_status out. What is invalid is refused, counted, and told
/// in the log, at most once in five seconds per topic.
class DdsAdapter : public PerceptSink {
 public:
  /// Joins the data space with writers only. Throws DdsError.
  DdsAdapter(const core::NetworkOptions& network, const robot::SerialArm& arm);
  ~DdsAdapter() override;

  /// Feeds what comes from now on to these, until stop_reading(). Both must live until then.
  void start_reading(SensingLoop& loop, WorkspaceKeeper& workspace);
  void stop_reading();
  /// A brick or version that the keeper could not use. Thread-safe.
  void count_refused_workspace(const std::string& why);
  /// Sends component_status. One thread.
  void publish_status(const core::Health& health);

  // Called by the sensing loop, on its thread.
  void on_drag(const StepOutputs& outputs, const TickInfo& info) override;
  void on_percept(const StepOutputs& outputs, const TickInfo& info) override;
  void on_alert(const percept::Alert& alert, bool cleared) override;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace phantom::phantom_sensing
