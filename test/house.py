"""What several tests know of the house, and of the machine they run on."""

import re
import shutil
import subprocess

import pytest

# Packages of ROS: one wing imports them, everything else runs without.
ROS = {'rclpy', 'builtin_interfaces', 'diagnostic_msgs', 'lifecycle_msgs', 'rcl_interfaces',
       'sensor_msgs', 'std_msgs', 'std_srvs'}


def sheets(page, folder):
    """Return on how many sheets of paper a page is printed."""
    browser = shutil.which('chromium') or shutil.which('google-chrome')
    if browser is None:
        pytest.skip('no browser prints pages here')
    printed = folder / 'page.pdf'
    subprocess.run(
        [browser, '--headless', '--no-sandbox', '--disable-gpu', '--no-pdf-header-footer',
         f'--user-data-dir={folder / "browser"}', f'--print-to-pdf={printed}', str(page)],
        check=True, capture_output=True, timeout=300)
    return len(re.findall(rb'/Type\s*/Page[^s]', printed.read_bytes()))
