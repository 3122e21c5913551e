#pragma once

#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "common/core/health.hpp"
#include "common/core/network.hpp"
#include "common/messages/percept.hpp"
#include "components/phantom_sensing/contact_register.hpp"
#include "components/phantom_sensing/sensing_loop.hpp"
#include "components/phantom_sensing/workspace/secondary_workspace.hpp"
#include "components/phantom_sensing/workspace/workspace_subscriber.hpp"

namespace phantom::phantom_sensing {

/// The component's DDS readers and writers. In: slave_state, gripper_state of an arm with fingers,
/// workspace_brick, workspace_version, workspace_object, mesh_chunk, pose_finding and sensing_command. Out:
/// drag_field, percept, interest_points, skin_percept, hit_alert, sensing_reply and component_status. Invalid
/// samples are refused, counted, and reported in the log at most once in five seconds per topic.
class DdsAdapter : public PerceptSink {
 public:
  /// Joins the DDS domain with all writers and the reader of commands; start_reading() adds the other
  /// readers. `shares`: the partitions of the shares of the skin (share_partitions()): the process of one
  /// writes all but component_status there, and the arm's reads drag_field and percept there. `other_arms`:
  /// whose slave_state is read in their partitions; they must outlive this. Throws DdsError.
  DdsAdapter(const core::NetworkOptions& network, const PhantomModel& model,
             const std::vector<std::string>& shares = {}, std::span<const OtherArm> other_arms = {});
  ~DdsAdapter() override;

  /// Passes received samples to `loop` and `workspace` until stop_reading(). Both must live until then.
  void start_reading(SensingLoop& loop, WorkspaceSubscriber& workspace);
  void stop_reading();
  /// Returns whether a wva_server is present now. Thread-safe.
  bool workspace_attended() const;
  /// Returns the objects announced by the wva_server whose workspace is in use. Thread-safe.
  SecondaryWorkspace::Objects objects() const;
  /// Returns which of these do not stand where depth cameras see them. Thread-safe.
  DisplacedObjects displaced() const;
  /// Compares these, and what arms carry, with the arm's workspace where this senses a share in another one:
  /// SecondaryWorkspace::compare(). One thread.
  std::vector<std::string> objects_apart(SecondaryWorkspace& workspaces, core::Nanoseconds now_ns) const;
  /// Carries out the commands received so far, on the calling thread, and answers them. A repeated command is
  /// answered again but not carried out again.
  void handle_commands(const std::function<Answer(const messages::SensingCommand&)>& carry_out);
  /// Returns what the workspace keeper tells this: each brick or version that it refused is counted, and
  /// logged with the reason; from sources in excess nothing is taken meanwhile. Valid as long as this.
  WorkspaceSubscriber::Callbacks workspace_callbacks();
  /// Publishes skin_percept. One thread.
  void publish_skin(const messages::SkinPercept& skin);
  /// Publishes component_status. One thread.
  void publish_status(const core::Health& health);

  // Called on the sensing loop's thread; on_alert() and on_doubt() on the relay's thread.
  void on_drag(const StepOutputs& outputs, const TickInfo& info) override;
  void on_percept(const StepOutputs& outputs, const TickInfo& info) override;
  void on_alert(const percept::Alert& alert, bool cleared) override;
  void on_doubt(const percept::ModelDoubt& doubt, bool holds) override;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace phantom::phantom_sensing
