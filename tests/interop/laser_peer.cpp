// The cloud of a scan whose laser moves, by the C++ class: its fields, and the values of each point.
#include <laser_geometry/laser_geometry.h>
#include <tf2/buffer_core.h>

#include <cmath>
#include <cstring>
#include <iomanip>
#include <iostream>

int main() {
  tf2::BufferCore buffer;
  for (int at = 0; at < 2; ++at) {
    geometry_msgs::TransformStamped transform;
    transform.header.frame_id = "map";
    transform.child_frame_id = "laser";
    transform.header.stamp = ros::Time(10 + at);
    transform.transform.translation.x = 1 + 2 * at;
    transform.transform.translation.y = -3 * at;
    transform.transform.translation.z = 0.5 * at;
    transform.transform.rotation.x = 0.3 * at;
    transform.transform.rotation.z = std::sin(0.2 + 0.9 * at) * std::sqrt(1 - 0.09 * at);
    transform.transform.rotation.w = std::cos(0.2 + 0.9 * at) * std::sqrt(1 - 0.09 * at);
    buffer.setTransform(transform, "test");
  }
  sensor_msgs::LaserScan scan;
  scan.header.frame_id = "laser";
  scan.header.stamp = ros::Time(10, 100000000);
  scan.angle_min = -2.0;
  scan.angle_increment = 4.0 / 99;
  scan.angle_max = 2.0;
  scan.time_increment = 0.008;
  scan.range_min = 0.5;
  scan.range_max = 9.0;
  for (int at = 0; at < 100; ++at) {
    scan.ranges.push_back(at % 7 == 3 ? 20.0 : 1.0 + at * 0.07);
    scan.intensities.push_back(at);
  }

  laser_geometry::LaserProjection projection;
  for (int options : {3, 31, 16, 1}) {
    sensor_msgs::PointCloud2 cloud;
    projection.transformLaserScanToPointCloud("map", scan, cloud, buffer, -1.0, options);
    std::cout << "cloud " << options << " " << cloud.header.frame_id << " " << cloud.header.stamp << " " << cloud.width;
    for (const auto &field : cloud.fields) std::cout << " " << field.name;
    std::cout << std::setprecision(9) << std::endl;
    for (size_t at = 0; at < cloud.width; ++at) {
      for (const auto &field : cloud.fields) {
        const uint8_t *place = &cloud.data[at * cloud.point_step + field.offset];
        float real;
        int32_t whole;
        std::memcpy(&real, place, 4);
        std::memcpy(&whole, place, 4);
        std::cout << (field.datatype == 5 ? double(whole) : double(real)) << " ";
      }
      std::cout << std::endl;
    }
  }
}
