#include "components/phantom_sensing/contact_register.hpp"

#include <algorithm>
#include <cmath>

#include "common/core/text.hpp"

namespace phantom::phantom_sensing {
namespace {

Answer refused(const std::string& why) { return {false, why}; }

}  // namespace

std::string ContactRegister::object_name(std::uint16_t id) const {
  const auto found = names_.find(id);
  return found != names_.end() ? found->second : "object " + std::to_string(id);
}

std::string ContactRegister::describe(const ContactPermit& permit) const {
  const bool whole = permit.link == percept::AllowedContact::kWholeArm;
  return object_name(permit.object) + " by " + (whole ? "the whole arm" : arm_.links()[permit.link].name);
}

Answer ContactRegister::allow(const messages::SensingCommand& request, std::uint16_t id, std::size_t link,
                              core::Nanoseconds now_ns) {
  ContactPermit permit{id, link};
  if (request.duration_s > 0.0) permit.until_ns = now_ns + core::from_seconds(request.duration_s);
  if (!permits_.allow(permit)) {
    return refused("there are " + std::to_string(ContactPermits::kMax) +
                   " allowed contacts already; allowed: no more, forbid one first");
  }
  return {true, "contact allowed: " + describe(permit) +
                    (request.duration_s > 0.0 ? core::formatted(" for %g s", request.duration_s) : "")};
}

Answer ContactRegister::handle(const messages::SensingCommand& request, core::Nanoseconds now_ns) {
  if (request.object.empty() && request.id == 0) {
    const std::size_t count = permits_.size();
    permits_.forbid_all();
    return {true, "all contact is felt again (" + std::to_string(count) + " had been allowed)"};
  }
  std::uint16_t id = request.id;
  if (!request.object.empty()) {
    id = 0;
    std::string known;
    for (const auto& [candidate, name] : names_) {
      if (name == request.object) id = candidate;
      core::add_to_list(known, name);
    }
    if (id == 0) return refused("no object is called '" + request.object + "'; allowed: " + known);
  }
  std::size_t link = percept::AllowedContact::kWholeArm;
  if (!request.link.empty()) {
    const auto frame = arm_.find_frame(request.link);
    if (!frame || frame->first == 0)
      return refused("the arm has no moving link called '" + request.link + "'");
    link = frame->first;
  }
  if (request.request == messages::SensingRequest::kAllowContact) return allow(request, id, link, now_ns);
  if (!permits_.forbid(id, link)) return refused("not allowed before: " + describe({id, link}));
  return {true, "contact felt again: " + describe({id, link})};
}

Answer ContactRegister::list(core::Nanoseconds now_ns) const {
  std::string allowed;
  permits_.for_each([&](const ContactPermit& permit) {
    const double left_s = std::round(10.0 * std::max(0.0, core::seconds(permit.until_ns - now_ns))) / 10.0;
    core::add_to_list(allowed, describe(permit) + (permit.until_ns == ContactPermit::kForever
                                                       ? ""
                                                       : core::formatted(" for %g s more", left_s)));
  });
  return {true, allowed.empty() ? "no contact is allowed" : "allowed: " + allowed};
}

std::vector<std::string> ContactRegister::end_old(core::Nanoseconds now_ns) {
  std::vector<std::string> ended;
  for (const ContactPermit& permit : permits_.take_ended(now_ns))
    ended.push_back("contact felt again, its time is over: " + describe(permit));
  return ended;
}

}  // namespace phantom::phantom_sensing
