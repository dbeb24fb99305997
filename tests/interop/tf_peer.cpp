// A roscpp node of tf2_ros. `tf_peer send`: transforms from lines, to /tf and /tf_static.
// `tf_peer listen`: lookups from lines, answered by the pose or by the exception's text.
#include <cstdio>
#include <iostream>
#include <sstream>
#include <string>

#include <geometry_msgs/TransformStamped.h>
#include <ros/ros.h>
#include <tf2_ros/buffer.h>
#include <tf2_ros/static_transform_broadcaster.h>
#include <tf2_ros/transform_broadcaster.h>
#include <tf2_ros/transform_listener.h>

namespace
{
void send(ros::NodeHandle& node)
{
  tf2_ros::TransformBroadcaster broadcaster;
  tf2_ros::StaticTransformBroadcaster latched;
  std::cout << "ready" << std::endl;
  std::string line;
  while (std::getline(std::cin, line))
  {
    std::istringstream words(line);
    geometry_msgs::TransformStamped message;
    int is_static;
    geometry_msgs::Vector3& where = message.transform.translation;
    geometry_msgs::Quaternion& turn = message.transform.rotation;
    words >> is_static >> message.header.frame_id >> message.child_frame_id >> message.header.stamp.sec >> message.header.stamp.nsec >>
        where.x >> where.y >> where.z >> turn.x >> turn.y >> turn.z >> turn.w;
    if (is_static)
    {
      latched.sendTransform(message);
    }
    else
    {
      broadcaster.sendTransform(message);
    }
    std::cout << "sent" << std::endl;
  }
}

void listen(ros::NodeHandle& node)
{
  tf2_ros::Buffer buffer;
  tf2_ros::TransformListener listener(buffer);
  std::cout << "ready" << std::endl;
  std::string line;
  while (std::getline(std::cin, line))
  {
    std::istringstream words(line);
    std::string target, source;
    ros::Time time;
    double timeout;
    words >> target >> source >> time.sec >> time.nsec >> timeout;
    try
    {
      const geometry_msgs::TransformStamped found = buffer.lookupTransform(target, source, time, ros::Duration(timeout));
      const geometry_msgs::Vector3& where = found.transform.translation;
      const geometry_msgs::Quaternion& turn = found.transform.rotation;
      std::printf("%u %u %.17g %.17g %.17g %.17g %.17g %.17g %.17g\n", found.header.stamp.sec, found.header.stamp.nsec, where.x, where.y,
                  where.z, turn.x, turn.y, turn.z, turn.w);
    }
    catch (const tf2::TransformException& error)
    {
      std::printf("error %s\n", error.what());
    }
    std::fflush(stdout);
  }
}
}  // namespace

int main(int argc, char** argv)
{
  ros::init(argc, argv, std::string("tf_peer_") + argv[1]);
  ros::NodeHandle node;
  if (std::string(argv[1]) == "send")
  {
    send(node);
  }
  else
  {
    listen(node);
  }
  return 0;
}
