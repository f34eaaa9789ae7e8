// A participant of Fast DDS with the keys of an enclave, which publishes and takes geometry_msgs/PoseStamped on /pose,
// as a node on rmw_fastrtps_cpp does. Prints the frame of each pose that it takes. Ends when its standard input does.
//
// g++ -std=c++17 -o fastdds_peer fastdds_peer.cpp -lfastrtps -lfastcdr
// fastdds_peer DOMAIN ENCLAVE NAME

#include <unistd.h>

#include <cstdlib>
#include <cstring>
#include <iostream>
#include <poll.h>
#include <string>

#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/publisher/DataWriter.hpp>
#include <fastdds/dds/publisher/Publisher.hpp>
#include <fastdds/dds/subscriber/DataReader.hpp>
#include <fastdds/dds/subscriber/SampleInfo.hpp>
#include <fastdds/dds/subscriber/Subscriber.hpp>
#include <fastdds/dds/topic/TopicDataType.hpp>
#include <fastrtps/utils/IPLocator.h>

using namespace eprosima::fastdds::dds;
using eprosima::fastrtps::rtps::InstanceHandle_t;
using eprosima::fastrtps::rtps::IPLocator;
using eprosima::fastrtps::rtps::Locator_t;
using eprosima::fastrtps::rtps::SerializedPayload_t;

// A message as its bytes.
class Bytes : public TopicDataType {
public:
    Bytes() {
        setName("geometry_msgs::msg::dds_::PoseStamped_");
        m_typeSize = 4096;
        m_isGetKeyDefined = false;
    }
    bool serialize(void *data, SerializedPayload_t *payload) override {
        const auto &bytes = *static_cast<std::string *>(data);
        std::memcpy(payload->data, bytes.data(), bytes.size());
        payload->length = bytes.size();
        payload->encapsulation = CDR_LE;
        return true;
    }
    bool deserialize(SerializedPayload_t *payload, void *data) override {
        static_cast<std::string *>(data)->assign(reinterpret_cast<char *>(payload->data), payload->length);
        return true;
    }
    std::function<uint32_t()> getSerializedSizeProvider(void *data) override {
        return [data] { return static_cast<uint32_t>(static_cast<std::string *>(data)->size()); };
    }
    void *createData() override { return new std::string; }
    void deleteData(void *data) override { delete static_cast<std::string *>(data); }
    bool getKey(void *, InstanceHandle_t *, bool) override { return false; }
};

template <typename T> void append(std::string &bytes, T value) {
    while ((bytes.size() - 4) % sizeof(T) != 0) {
        bytes.push_back(0);
    }
    bytes.append(reinterpret_cast<char *>(&value), sizeof(T));
}

// A pose at (1, 2) in a frame of this name, in CDR.
std::string pose(const std::string &name) {
    std::string bytes("\0\1\0\0", 4);
    append<int32_t>(bytes, 0);
    append<uint32_t>(bytes, 0);
    append<uint32_t>(bytes, name.size() + 1);
    bytes.append(name.c_str(), name.size() + 1);
    for (double value : {1.0, 2.0, 0.0, 0.0, 0.0, 0.0, 1.0}) {
        append<double>(bytes, value);
    }
    return bytes;
}

int main(int, char **arguments) {
    const int domain = std::atoi(arguments[1]);
    const std::string folder = std::string("file://") + arguments[2] + "/", name = arguments[3];
    DomainParticipantQos qos;
    // The participants of this computer, should its loopback device carry no multicast.
    for (int participant = 0; participant < 8; ++participant) {
        Locator_t locator;
        IPLocator::setIPv4(locator, 127, 0, 0, 1);
        locator.port = 7410 + 250 * domain + 2 * participant;
        qos.wire_protocol().builtin.initialPeersList.push_back(locator);
    }
    auto set = [&](const char *property, const std::string &value) {
        qos.properties().properties().emplace_back(property, value);
    };
    set("dds.sec.auth.plugin", "builtin.PKI-DH");
    set("dds.sec.auth.builtin.PKI-DH.identity_ca", folder + "identity_ca.cert.pem");
    set("dds.sec.auth.builtin.PKI-DH.identity_certificate", folder + "cert.pem");
    set("dds.sec.auth.builtin.PKI-DH.private_key", folder + "key.pem");
    set("dds.sec.crypto.plugin", "builtin.AES-GCM-GMAC");
    set("dds.sec.access.plugin", "builtin.Access-Permissions");
    set("dds.sec.access.builtin.Access-Permissions.permissions_ca", folder + "permissions_ca.cert.pem");
    set("dds.sec.access.builtin.Access-Permissions.governance", folder + "governance.p7s");
    set("dds.sec.access.builtin.Access-Permissions.permissions", folder + "permissions.p7s");
    auto *participant = DomainParticipantFactory::get_instance()->create_participant(domain, qos);
    if (participant == nullptr) {
        std::cout << "no participant" << std::endl;
        return 1;
    }
    TypeSupport type(new Bytes);
    type.register_type(participant);
    auto *topic = participant->create_topic("rt/pose", type.get_type_name(), TOPIC_QOS_DEFAULT);
    auto *reader = participant->create_subscriber(SUBSCRIBER_QOS_DEFAULT)
                       ->create_datareader(topic, DATAREADER_QOS_DEFAULT);
    auto *writer = participant->create_publisher(PUBLISHER_QOS_DEFAULT)
                       ->create_datawriter(topic, DATAWRITER_QOS_DEFAULT);
    if (reader == nullptr || writer == nullptr) {
        std::cout << "no endpoint" << std::endl;
        _exit(1);
    }
    std::cout << "ready" << std::endl;
    std::string ours = pose(name), theirs;
    pollfd input{0, POLLIN, 0};
    while (poll(&input, 1, 50) == 0) {
        writer->write(&ours);
        SampleInfo info;
        while (reader->take_next_sample(&theirs, &info) == ReturnCode_t::RETCODE_OK) {
            if (info.valid_data && theirs.size() > 16) {
                std::cout << "heard " << theirs.c_str() + 16 << std::endl;
            }
        }
    }
    // The library's destructors fail with OpenSSL 3.
    _exit(0);
}
