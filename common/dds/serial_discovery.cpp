#include "common/dds/serial_discovery.hpp"

#include <fastdds/rtps/network/SenderResource.h>
#include <fastdds/rtps/transport/ChainingTransport.h>
#include <fastdds/rtps/transport/TransportReceiverInterface.h>
#include <fastrtps/utils/IPLocator.h>

#include <mutex>

namespace phantom::dds {
namespace {

namespace rtps = eprosima::fastrtps::rtps;
namespace transport = eprosima::fastdds::rtps;

class SerialDiscovery final : public transport::ChainingTransport {
 public:
  explicit SerialDiscovery(const SerialDiscoveryDescriptor& descriptor)
      : ChainingTransport(descriptor), descriptor_(descriptor) {}

  transport::TransportDescriptorInterface* get_configuration() override { return &descriptor_; }

  bool send(rtps::SenderResource* below, const rtps::octet* message, std::uint32_t size,
            rtps::LocatorsIterator* first, rtps::LocatorsIterator* last,
            const std::chrono::steady_clock::time_point& timeout) override {
    return below->send(message, size, first, last, timeout);
  }

  void receive(transport::TransportReceiverInterface* above, const rtps::octet* message, std::uint32_t size,
               const rtps::Locator_t& local, const rtps::Locator_t& remote) override {
    const bool discovery = rtps::IPLocator::getPhysicalPort(local) % 2 == 0;
    const auto lock = discovery ? std::unique_lock(discovery_) : std::unique_lock<std::mutex>();
    above->OnDataReceived(message, size, local, remote);
  }

 private:
  SerialDiscoveryDescriptor descriptor_;
  std::mutex discovery_;
};

}  // namespace

transport::TransportInterface* SerialDiscoveryDescriptor::create_transport() const {
  return new SerialDiscovery(*this);
}

}  // namespace phantom::dds
