// A client on Fast DDS that calls `get_state` of a node again and again, as a client on rmw_fastrtps_cpp does, each time with
// endpoints of its own: the call goes out as soon as they are matched. Prints the milliseconds that each call took.
//
// g++ -std=c++17 -o fastdds_client fastdds_client.cpp -lfastrtps -lfastcdr
// fastdds_client DOMAIN CALLS

#include <chrono>
#include <cstdlib>
#include <cstring>
#include <iostream>
#include <string>
#include <thread>

#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/publisher/DataWriter.hpp>
#include <fastdds/dds/publisher/Publisher.hpp>
#include <fastdds/dds/subscriber/DataReader.hpp>
#include <fastdds/dds/subscriber/SampleInfo.hpp>
#include <fastdds/dds/subscriber/Subscriber.hpp>
#include <fastdds/dds/topic/TopicDataType.hpp>
#include <fastdds/rtps/common/WriteParams.h>
#include <fastrtps/utils/IPLocator.h>

using namespace eprosima::fastdds::dds;
using eprosima::fastrtps::rtps::InstanceHandle_t;
using eprosima::fastrtps::rtps::IPLocator;
using eprosima::fastrtps::rtps::Locator_t;
using eprosima::fastrtps::rtps::SerializedPayload_t;
using eprosima::fastrtps::rtps::WriteParams;
using Clock = std::chrono::steady_clock;

// A message as its bytes.
class Bytes : public TopicDataType {
public:
    explicit Bytes(const char *name) {
        setName(name);
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

double since(Clock::time_point begun) {
    return std::chrono::duration<double, std::milli>(Clock::now() - begun).count();
}

int main(int, char **arguments) {
    const int domain = std::atoi(arguments[1]), calls = std::atoi(arguments[2]);
    DomainParticipantQos qos;
    // The participants of this computer, should its loopback device carry no multicast.
    for (int participant = 0; participant < 8; ++participant) {
        Locator_t locator;
        IPLocator::setIPv4(locator, 127, 0, 0, 1);
        locator.port = 7410 + 250 * domain + 2 * participant;
        qos.wire_protocol().builtin.initialPeersList.push_back(locator);
    }
    auto *participant = DomainParticipantFactory::get_instance()->create_participant(domain, qos);
    TypeSupport requests(new Bytes("lifecycle_msgs::srv::dds_::GetState_Request_"));
    TypeSupport replies(new Bytes("lifecycle_msgs::srv::dds_::GetState_Response_"));
    requests.register_type(participant);
    replies.register_type(participant);
    auto *asked = participant->create_topic("rq/flockform/get_stateRequest", requests.get_type_name(), TOPIC_QOS_DEFAULT);
    auto *answered = participant->create_topic("rr/flockform/get_stateReply", replies.get_type_name(), TOPIC_QOS_DEFAULT);
    auto *publisher = participant->create_publisher(PUBLISHER_QOS_DEFAULT);
    auto *subscriber = participant->create_subscriber(SUBSCRIBER_QOS_DEFAULT);
    DataReaderQos reader_qos = DATAREADER_QOS_DEFAULT;
    reader_qos.reliability().kind = RELIABLE_RELIABILITY_QOS;
    DataWriterQos writer_qos = DATAWRITER_QOS_DEFAULT;
    writer_qos.durability().kind = VOLATILE_DURABILITY_QOS;
    for (int call = 0; call < calls; ++call) {
        auto *reader = subscriber->create_datareader(answered, reader_qos);
        auto *writer = publisher->create_datawriter(asked, writer_qos);
        auto begun = Clock::now();
        PublicationMatchedStatus writers;
        SubscriptionMatchedStatus readers;
        do {
            std::this_thread::sleep_for(std::chrono::microseconds(50));
            writer->get_publication_matched_status(writers);
            reader->get_subscription_matched_status(readers);
        } while ((writers.current_count == 0 || readers.current_count == 0) && since(begun) < 20000);
        std::string request("\0\1\0\0\0", 5), reply;
        WriteParams identity;
        identity.related_sample_identity().writer_guid() = reader->guid();
        begun = Clock::now();
        writer->write(&request, identity);
        SampleInfo info;
        bool is_answered = false;
        while (!is_answered && since(begun) < 8000) {
            std::this_thread::sleep_for(std::chrono::microseconds(200));
            is_answered = reader->take_next_sample(&reply, &info) == ReturnCode_t::RETCODE_OK && info.valid_data;
        }
        std::cout << (is_answered ? since(begun) : 1e9) << std::endl;
        publisher->delete_datawriter(writer);
        subscriber->delete_datareader(reader);
    }
    std::_Exit(0);
}
