"""Which version a process runs."""

import subprocess

from robotont_driver.ros.version import version


def test_a_clone_is_on_a_branch_or_on_none_or_no_clone_at_all(tmp_path):
    assert version(tmp_path) == ""
    (tmp_path / "robotont_driver").mkdir()
    (tmp_path / "robotont_driver" / "package.xml").write_text("<package>\n  <version>1.2.3</version>\n</package>")
    assert version(tmp_path) == "1.2.3"

    def git(*words):
        return subprocess.run(["git", "-C", tmp_path, "-c", "user.name=a", "-c", "user.email=a@b", *words], check=True,
                              stdout=subprocess.PIPE, text=True).stdout.strip()
    git("init", "-q")
    assert version(tmp_path) == "1.2.3"
    for message in ("one", "two"):
        git("commit", "-q", "--allow-empty", "-m", message)
        assert version(tmp_path) == f"1.2.3 ({git('rev-parse', 'HEAD')[:8]})"
    git("gc", "-q")
    git("checkout", "-q", "HEAD~1")
    assert version(tmp_path) == f"1.2.3 ({git('rev-parse', 'HEAD')[:8]})"
