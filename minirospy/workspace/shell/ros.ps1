# roscd, rosls, rosed, roscat, roscp, rosmv, rospd, rosd and TAB completion, for PowerShell: to be sourced.
#
# What can be completed is known by `minirospy complete` alone; here is only what a program cannot do for its shell.
# The same as ros.bash, which says more. Source: http://wiki.ros.org/rosbash.

# The folder of PACKAGE[/FOLDER]; nothing where rospack has said what is wrong.
function global:_ros_folder([string] $target) {
    $package, $rest = $target -split '[/\\]', 2
    $folder = rospack find $package
    if ($LASTEXITCODE -ne 0 -or -not $folder) { return }
    if ($rest) { Join-Path $folder $rest } else { $folder }
}

# The first file of a name at or below the folder of a package.
function global:_ros_file([string] $package, [string] $name) {
    $folder = _ros_folder $package
    if (-not $folder) { return }
    $direct = Join-Path $folder $name
    if (Test-Path -LiteralPath $direct) { return $direct }
    $found = Get-ChildItem -LiteralPath $folder -Recurse -File -Filter $name | Select-Object -First 1
    if ($found) { return $found.FullName }
    Write-Error "file `"$name`" does not exist in `"$folder`""
}

function global:roscd([string] $target) {
    if ($target) {
        $folder = _ros_folder $target
        if ($folder) { Set-Location -LiteralPath $folder }
        return
    }
    $place = $env:ROS_WORKSPACE
    if (-not $place -and $env:CMAKE_PREFIX_PATH) { $place = $env:CMAKE_PREFIX_PATH.Split([IO.Path]::PathSeparator)[0] }
    if ($place) { Set-Location -LiteralPath $place }
    else { Write-Error 'roscd: ERROR: no workspace: source its devel/setup.ps1, or set ROS_WORKSPACE' }
}

function global:rosls([string] $package) {
    if (-not $package) { Write-Error 'usage: rosls package'; return }
    $folder = _ros_folder $package
    if ($folder) { Get-ChildItem -LiteralPath $folder }
}

function global:rosed([string] $package, [string] $name) {
    if (-not $name) { Write-Error 'usage: rosed package filename'; return }
    $file = _ros_file $package $name
    if (-not $file) { return }
    $editor = if ($env:EDITOR) { $env:EDITOR } elseif (Get-Command notepad -ErrorAction SilentlyContinue) { 'notepad' } else { 'vi' }
    & $editor $file
}

function global:roscat([string] $package, [string] $name) {
    if (-not $name) { Write-Error 'usage: roscat package filename'; return }
    $file = _ros_file $package $name
    if ($file) { Get-Content -LiteralPath $file }
}

function global:roscp([string] $package, [string] $name, [string] $target) {
    if (-not $target) { Write-Error 'usage: roscp package filename target'; return }
    $file = _ros_file $package $name
    if ($file) { Copy-Item -LiteralPath $file -Destination $target }
}

function global:rosmv([string] $package, [string] $name, [string] $target) {
    if (-not $target) { Write-Error 'usage: rosmv package filename target'; return }
    $file = _ros_file $package $name
    if ($file) { Move-Item -LiteralPath $file -Destination $target }
}

function global:rospd([string] $package) {
    if (-not $package) { Push-Location; return }
    $folder = _ros_folder $package
    if ($folder) { Push-Location -LiteralPath $folder }
}

function global:rosd { Get-Location -Stack }

# --- completion

$_ros_commands = @(
    'roscd', 'rospd', 'rosls', 'rosed', 'roscat', 'roscp', 'rosmv', 'minirospy', 'rosrun', 'roslaunch', 'rostopic',
    'rosnode', 'rosservice', 'rosparam', 'rosmsg', 'rossrv', 'rosbag', 'rosconsole', 'rosgraph', 'rosclean',
    'rosversion', 'rospack', 'rostest', 'catkin_make', 'roscore', 'rosmaster', 'roslaunch-deps', 'roslaunch-logs',
    'rosstack', 'rosdep', 'rosmsg-proto', 'roswtf', 'rqt', 'rqt_bag', 'rqt_console', 'rqt_controller_manager',
    'rqt_graph', 'rqt_image_view', 'rqt_joint_trajectory_controller', 'rqt_launch', 'rqt_logger_level', 'rqt_plot',
    'rqt_publisher', 'rqt_reconfigure', 'rqt_robot_monitor', 'rqt_robot_steering', 'rqt_runtime_monitor',
    'rqt_service_caller', 'rqt_tf_tree', 'rqt_top', 'rqt_topic', 'rviz', 'smach_viewer', 'rosunit', 'xacro',
    'check_urdf', 'urdf_to_graphviz', 'urdf_to_graphiz', 'catkin_test_results', 'catkin_make_isolated', 'catkin',
    'catkin_create_pkg', 'catkin_init_workspace', 'catkin_find', 'catkin_find_pkg', 'catkin_topological_order'
)
$_ros_complete = {
    param($word, $ast, $cursor)
    $words = @($ast.CommandElements | Where-Object { $_.Extent.StartOffset -lt $cursor } | ForEach-Object { $_.Extent.Text })
    # A word that has not been started is not passed on: Windows PowerShell drops empty arguments of programs.
    $index = if ($word) { $words.Count - 1 } else { $words.Count }
    minirospy complete --powershell $index @words 2>$null | Where-Object { $_ } | ForEach-Object {
        [System.Management.Automation.CompletionResult]::new($_, $_, 'ParameterValue', $_)
    }
}
Register-ArgumentCompleter -Native -CommandName $_ros_commands -ScriptBlock $_ros_complete
foreach ($_ros_function in 'roscd', 'rosls', 'rosed', 'roscat', 'roscp', 'rosmv', 'rospd') {
    # Functions are completed parameter by parameter: -Native is for programs.
    Register-ArgumentCompleter -CommandName $_ros_function -ParameterName 'target' -ScriptBlock {
        param($command, $parameter, $word, $ast)
        minirospy complete --powershell 1 $command $word 2>$null | Where-Object { $_ }
    }
    Register-ArgumentCompleter -CommandName $_ros_function -ParameterName 'package' -ScriptBlock {
        param($command, $parameter, $word, $ast)
        minirospy complete --powershell 1 $command $word 2>$null | Where-Object { $_ }
    }
}
Remove-Variable -Name _ros_commands
Remove-Variable -Name _ros_complete
Remove-Variable -Name _ros_function
