#pragma once

#include <functional>
#include <map>
#include <memory>
#include <string>

#include "common/core/health.hpp"
#include "common/core/network.hpp"
#include "common/messages/percept.hpp"
#include "components/phantom_sensing/contact_register.hpp"
#include "components/phantom_sensing/sensing_loop.hpp"
#include "components/phantom_sensing/workspace_keeper.hpp"

namespace phantom::phantom_sensing {

/// Everything that this component says and hears over DDS: slave_state, workspace_brick, workspace_version,
/// workspace_object and sensing_command in; drag_field, percept, interest_points, skin_percept, hit_alert,
/// sensing_reply and component_status out. What is invalid is refused, counted, and told in the log, at most
/// once in five seconds per topic.
class DdsAdapter : public PerceptSink {
 public:
  /// Joins the data space with writers, and takes commands in; other readers follow with start_reading().
  /// Throws DdsError.
  DdsAdapter(const core::NetworkOptions& network, const PhantomModel& model);
  ~DdsAdapter() override;

  /// Feeds what comes from now on to these, until stop_reading(). Both must live until then.
  void start_reading(SensingLoop& loop, WorkspaceKeeper& workspace);
  void stop_reading();
  /// Whether a wva_server is there now. Thread-safe.
  bool workspace_attended() const;
  /// The objects that have been announced by the wva_server whose workspace is in use, by id. Thread-safe.
  std::map<std::uint16_t, std::string> objects() const;
  /// Who carries out what sensing_command asks for.
  struct Handlers {
    std::function<Answer(const ContactRequest&)> contact;
    std::function<Answer()> list_contacts;
    std::function<Answer()> self_test;
  };
  /// Carries out and answers, on the calling thread, the commands that have come; those that come again are
  /// answered again and not carried out again.
  void handle_commands(const Handlers& handlers);
  /// A brick or version that the keeper could not use. Thread-safe.
  void count_refused_workspace(const std::string& why);
  /// The newest slave_state that was sound; false if none came since the last call. One thread.
  bool newest_slave(SlaveSample& sample);
  /// Sends skin_percept. One thread.
  void publish_skin(const messages::SkinPercept& skin);
  /// Sends component_status. One thread.
  void publish_status(const core::Health& health);

  // Called by the sensing loop, on its thread; on_alert() by the relay, on its own.
  void on_drag(const StepOutputs& outputs, const TickInfo& info) override;
  void on_percept(const StepOutputs& outputs, const TickInfo& info) override;
  void on_alert(const percept::Alert& alert, bool cleared) override;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace phantom::phantom_sensing
