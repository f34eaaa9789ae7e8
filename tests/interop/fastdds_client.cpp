// A client on Fast DDS that calls a service of a node as a client on rmw_fastrtps_cpp does: `get_state` again and again, each
// time with endpoints of its own, or any service with these requests (hexadecimal, with their encapsulation), all with the
// same endpoints. A call goes out as soon as they are matched. Prints the milliseconds and the length of the reply of each.
//
// g++ -std=c++17 -o fastdds_client fastdds_client.cpp -lfastrtps -lfastcdr
// fastdds_client DOMAIN CALLS
// fastdds_client DOMAIN SERVICE TYPE REQUEST...

#include <chrono>
#include <cstdlib>
#include <cstring>
#include <iostream>
#include <string>
#include <thread>
#include <vector>

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
        m_typeSize = 65536;
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

// The endpoints of a client.
struct Client {
    Publisher *publisher;
    Subscriber *subscriber;
    DataReader *reader;
    DataWriter *writer;

    Client(Publisher *publisher, Subscriber *subscriber, Topic *asked, Topic *answered)
        : publisher(publisher), subscriber(subscriber) {
        DataReaderQos reader_qos = DATAREADER_QOS_DEFAULT;
        reader_qos.reliability().kind = RELIABLE_RELIABILITY_QOS;
        DataWriterQos writer_qos = DATAWRITER_QOS_DEFAULT;
        writer_qos.durability().kind = VOLATILE_DURABILITY_QOS;
        reader = subscriber->create_datareader(answered, reader_qos);
        writer = publisher->create_datawriter(asked, writer_qos);
        auto begun = Clock::now();
        PublicationMatchedStatus writers;
        SubscriptionMatchedStatus readers;
        do {
            std::this_thread::sleep_for(std::chrono::microseconds(50));
            writer->get_publication_matched_status(writers);
            reader->get_subscription_matched_status(readers);
        } while ((writers.current_count == 0 || readers.current_count == 0) && since(begun) < 20000);
    }

    ~Client() {
        publisher->delete_datawriter(writer);
        subscriber->delete_datareader(reader);
    }

    void call(std::string request) {
        std::string reply;
        WriteParams identity;
        identity.related_sample_identity().writer_guid() = reader->guid();
        auto begun = Clock::now();
        writer->write(&request, identity);
        SampleInfo info;
        bool is_answered = false;
        while (!is_answered && since(begun) < 8000) {
            std::this_thread::sleep_for(std::chrono::microseconds(200));
            is_answered = reader->take_next_sample(&reply, &info) == ReturnCode_t::RETCODE_OK && info.valid_data
                && info.related_sample_identity.writer_guid() == reader->guid();
        }
        std::cout << (is_answered ? since(begun) : 1e9) << ' ' << reply.size() << std::endl;
    }
};

std::string bytes_of(const std::string &hexadecimal) {
    std::string bytes;
    for (size_t at = 0; at + 1 < hexadecimal.size(); at += 2) {
        bytes.push_back(static_cast<char>(std::stoi(hexadecimal.substr(at, 2), nullptr, 16)));
    }
    return bytes;
}

int main(int count, char **arguments) {
    const int domain = std::atoi(arguments[1]);
    const std::string service = count > 4 ? arguments[2] : "flockform/get_state";
    const std::string type = count > 4 ? arguments[3] : "lifecycle_msgs::srv::dds_::GetState";
    DomainParticipantQos qos;
    // The participants of this computer, should its loopback device carry no multicast.
    for (int participant = 0; participant < 8; ++participant) {
        Locator_t locator;
        IPLocator::setIPv4(locator, 127, 0, 0, 1);
        locator.port = 7410 + 250 * domain + 2 * participant;
        qos.wire_protocol().builtin.initialPeersList.push_back(locator);
    }
    auto *participant = DomainParticipantFactory::get_instance()->create_participant(domain, qos);
    TypeSupport requests(new Bytes((type + "_Request_").c_str()));
    TypeSupport replies(new Bytes((type + "_Response_").c_str()));
    requests.register_type(participant);
    replies.register_type(participant);
    auto *asked = participant->create_topic("rq/" + service + "Request", requests.get_type_name(), TOPIC_QOS_DEFAULT);
    auto *answered = participant->create_topic("rr/" + service + "Reply", replies.get_type_name(), TOPIC_QOS_DEFAULT);
    auto *publisher = participant->create_publisher(PUBLISHER_QOS_DEFAULT);
    auto *subscriber = participant->create_subscriber(SUBSCRIBER_QOS_DEFAULT);
    if (count > 4) {
        Client client(publisher, subscriber, asked, answered);
        for (int request = 4; request < count; ++request) {
            client.call(bytes_of(arguments[request]));
        }
    } else {
        for (int call = 0; call < std::atoi(arguments[2]); ++call) {
            Client(publisher, subscriber, asked, answered).call(std::string("\0\1\0\0\0", 5));
        }
    }
    std::_Exit(0);
}
