#include "common/dds/endpoints/outbox.hpp"

#include <algorithm>
#include <chrono>
#include <utility>

namespace phantom::dds {

namespace rtps = fast_dds::rtps;

void Outbox::opened(const rtps::Locator_t& locator) {
  const std::lock_guard lock(mutex_);
  opened_.find_or_add(locator);
}

void Outbox::keep(const rtps::LocatorList_t& addresses) {
  const std::lock_guard lock(mutex_);
  for (const rtps::Locator_t& locator : addresses)
    if (opened_.contains(locator)) opened_.find_or_add(locator);
}

void Outbox::put(std::vector<std::uint8_t> message, rtps::LocatorList_t wanted) {
  const std::lock_guard lock(mutex_);
  rtps::LocatorList_t to;
  for (const rtps::Locator_t& locator : wanted) {
    if (!opened_.contains(locator)) continue;
    opened_.find_or_add(locator);
    to.push_back(locator);
  }
  if (to.empty()) return;
  letters_.push_back({std::move(message), std::move(to), 0, {}});
  any_.store(true, std::memory_order_release);
}

void Outbox::send_by(rtps::SenderResource& sender) {
  if (!any_.load(std::memory_order_acquire)) return;
  const std::lock_guard lock(mutex_);
  const core::Nanoseconds now = core::monotonic_ns();
  for (Letter& letter : letters_) {
    if (letter.first == 0) letter.first = now;
    if (std::find(letter.sent_by.begin(), letter.sent_by.end(), &sender) != letter.sent_by.end()) continue;
    letter.sent_by.push_back(&sender);
    rtps::Locators begin(letter.to.begin()), end(letter.to.end());
    // A lost message is sent again at the next attempt of whoever put it here.
    fast_dds::OutgoingMessage(letter.message, &begin, &end,
                              std::chrono::steady_clock::now() + std::chrono::milliseconds(10))
        .send_by(sender);
  }
  std::erase_if(letters_, [&](const Letter& letter) { return now - letter.first > kInTurn; });
  any_.store(!letters_.empty(), std::memory_order_release);
}

}  // namespace phantom::dds
