// A roscpp node with the roles and the output of peer.py.
#include <cstdio>
#include <functional>
#include <iostream>
#include <map>
#include <set>
#include <string>

#include <ros/ros.h>
#include <sensor_msgs/Image.h>
#include <sensor_msgs/LaserScan.h>
#include <std_msgs/Bool.h>
#include <std_msgs/String.h>
#include <std_srvs/SetBool.h>

namespace
{
// Length and CRC-32 of the serialised message, as zlib.crc32 counts it.
template <class M> std::string digest(const M& message)
{
  ros::SerializedMessage serialized = ros::serialization::serializeMessage(message);
  unsigned crc = 0xffffffffu;
  for (size_t i = 4; i < serialized.num_bytes; ++i)
  {
    crc ^= serialized.buf[i];
    for (int bit = 0; bit < 8; ++bit)
    {
      crc = (crc >> 1) ^ (0xedb88320u & (0u - (crc & 1u)));
    }
  }
  char text[32];
  std::snprintf(text, sizeof text, "%u-%08x", static_cast<unsigned>(serialized.num_bytes - 4), ~crc);
  return text;
}

void say(const std::string& line) { std::cout << line << std::endl; }

void untilInputEnds()
{
  ros::AsyncSpinner spinner(1);
  spinner.start();
  say("ready");
  std::string line;
  while (std::getline(std::cin, line)) {}
}

// roscpp keeps the latched message after it has published it: a subscriber that connects between the two gets nothing.
// The second call publishes to it.
template <class M> void publish(ros::NodeHandle& node, std::map<std::string, ros::Publisher>& keep, const std::string& kind, const M& message)
{
  keep[kind] = node.advertise<M>("/interop/" + kind, 1, true);
  keep[kind].publish(message);
  keep[kind].publish(message);
  say(kind + " " + digest(message));
}

void talk(ros::NodeHandle& node)
{
  std::map<std::string, ros::Publisher> keep;
  std_msgs::Bool flag;
  flag.data = true;
  publish(node, keep, "bool", flag);
  std_msgs::String text;
  text.data = "from C++";
  publish(node, keep, "string", text);
  sensor_msgs::LaserScan scan;
  scan.header.stamp = ros::Time(1234567890, 987654321);
  scan.header.frame_id = "scan";
  scan.range_max = 40;
  for (int i = 0; i < 1651; ++i)
  {
    scan.ranges.push_back(0.1f * i);
    scan.intensities.push_back(i % 256);
  }
  publish(node, keep, "scan", scan);
  sensor_msgs::Image image;
  image.header.frame_id = "camera";
  image.height = 1080;
  image.width = 1920;
  image.step = 3 * 1920;
  image.encoding = "rgb8";
  for (unsigned i = 0; i < image.step * image.height; ++i)
  {
    image.data.push_back(i % 251);
  }
  publish(node, keep, "image", image);
  untilInputEnds();
}

std::set<std::string> left;

void seen(const std::string& kind, const std::string& hash)
{
  say(kind + " " + hash);
  left.erase(kind);
  if (left.empty())
  {
    ros::shutdown();
  }
}

template <class M> ros::Subscriber subscribe(ros::NodeHandle& node, const std::string& kind)
{
  left.insert(kind);
  boost::function<void(const boost::shared_ptr<M const>&)> callback =
      [kind](const boost::shared_ptr<M const>& message) { seen(kind, digest(*message)); };
  return node.subscribe<M>("/interop/" + kind, 1, callback);
}

template <class M> ros::Subscriber subscribeStamped(ros::NodeHandle& node, const std::string& kind)
{
  left.insert(kind);
  boost::function<void(const boost::shared_ptr<M const>&)> callback = [kind](const boost::shared_ptr<M const>& message) {
    M copy = *message;
    copy.header.seq = 0;  // the publisher's own affair
    seen(kind, digest(copy));
  };
  return node.subscribe<M>("/interop/" + kind, 1, callback);
}

void listen(ros::NodeHandle& node)
{
  ros::Subscriber keep[] = {subscribe<std_msgs::Bool>(node, "bool"), subscribe<std_msgs::String>(node, "string"),
                            subscribeStamped<sensor_msgs::LaserScan>(node, "scan"),
                            subscribeStamped<sensor_msgs::Image>(node, "image")};
  ros::spin();
}

bool setFlag(std_srvs::SetBool::Request& request, std_srvs::SetBool::Response& response)
{
  response.success = request.data;
  response.message = std::string("flag: ") + (request.data ? "True" : "False");
  return true;
}

void serve(ros::NodeHandle& node)
{
  ros::ServiceServer server = node.advertiseService("/set_flag", setFlag);
  untilInputEnds();
}

int call(ros::NodeHandle& node)
{
  if (!ros::service::waitForService("/set_flag", 150000))
  {
    return 1;
  }
  for (bool persistent : {false, true})
  {
    ros::ServiceClient client = node.serviceClient<std_srvs::SetBool>("/set_flag", persistent);
    for (bool flag : {true, false})
    {
      std_srvs::SetBool service;
      service.request.data = flag;
      if (!client.call(service))
      {
        return 1;
      }
      say(std::string(service.response.success ? "True" : "False") + " " + service.response.message);
    }
  }
  return 0;
}
}  // namespace

int main(int argc, char** argv)
{
  const std::string role = argc > 1 ? argv[1] : "";
  ros::init(argc, argv, "peer_" + role, ros::init_options::NoSigintHandler);
  ros::NodeHandle node;
  if (role == "talk") talk(node);
  else if (role == "listen") listen(node);
  else if (role == "serve") serve(node);
  else if (role == "call") return call(node);
  else return 2;
  return 0;
}
