#pragma once

#include <gtest/gtest.h>

#include <deque>
#include <variant>
#include <vector>

#include "common/dds/tests/test_network.hpp"
#include "components/synthetic_viewer/topics/dds_adapter.hpp"
#include "components/synthetic_viewer/topics/tests/slave_message.hpp"

namespace phantom::synthetic_viewer {

/// The viewer's adapter, and another participant.
class Adapter : public ::testing::Test {
 protected:
  Inbox inbox_;
  DdsAdapter adapter_{dds::test_network(), kShape, inbox_};
  dds::Participant other_{"other", dds::test_network()};
  std::deque<Event> events_;  // all that came so far

  template <class T>
  std::vector<T> got() {
    for (Event& event : inbox_.take_hits()) events_.push_back(std::move(event));
    for (Event& event : inbox_.take_events()) events_.push_back(std::move(event));
    std::vector<T> found;
    for (const Event& event : events_) {
      if (const T* wanted = std::get_if<T>(&event)) found.push_back(*wanted);
    }
    return found;
  }
};

}  // namespace phantom::synthetic_viewer
